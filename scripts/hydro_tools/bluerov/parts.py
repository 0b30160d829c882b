"""What of the water a nominal can lack, and what the truth has in its place.

A part that the nominal has keeps the nominal's form in the truth, its numbers 3 % off. A part that it lacks has details
of its own there: coupled added mass and linear drag, drag with the power 1.9 and a part of it by the speed's norm, a
centre of buoyancy off the middle, buoyancy that is squeezed with depth, a current that wanders.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from . import fossen, numbers
from .fossen import Vehicle


class Part(Enum):
    """Parts by their name in the catalogue."""

    ADDED_MASS = "added_mass"
    LINEAR_DRAG = "linear_drag"
    QUADRATIC_DRAG = "quadratic_drag"
    BUOYANCY_OFFSET = "buoyancy_offset"
    NET_BUOYANCY = "net_buoyancy"
    CURRENT = "current"


#: What a complete nominal has.
WATER = frozenset(Part) - {Part.CURRENT}
#: Standard deviations: relative; of the mass, which is weighed; of each coordinate of the centre of mass [m]. With a
#: mass known to 3 % (4 N of 132) no net buoyancy of a few newton could be told from a wrong mass.
RELATIVE, WEIGHED, CENTRE = 0.03, 0.002, 0.001
#: Draws of these are cut at so many standard deviations.
CUT = 2.0
#: Off-diagonal parts, as fractions of the geometric mean of the diagonal.
_ADDED = {(0, 2): 0.06, (1, 5): 0.08, (0, 4): -0.05, (1, 3): 0.07}
_LINEAR = {(0, 4): 0.05, (2, 4): 0.05}


@dataclass(frozen=True)
class Uncertain:
    """An uncertain number: `moved(vehicle, z)` has it z standard deviations off."""

    name: str
    moved: Callable[[Vehicle, float], Vehicle]


def uncertain(nominal: frozenset[Part], configuration: str = "heavy") -> list[Uncertain]:
    """Every uncertain number of a nominal that has these parts."""
    out = [Uncertain("hull.mass", lambda v, z: v.replaced(mass=v.mass * (1 + WEIGHED * z)))]
    for i, axis in enumerate("xyz"):
        out.append(Uncertain(f"hull.inertia.{axis}", _scale("inertia", i)))
        out.append(Uncertain(f"hull.com.{axis}", _shift(i)))
    for i in range(len(numbers.PLACES[configuration])):
        out.append(Uncertain(f"thruster_{i + 1}.gain", _scale("gain", i)))
    for part, field, values in (
        (Part.ADDED_MASS, "added", numbers.ADDED_MASS),
        (Part.LINEAR_DRAG, "linear", numbers.LINEAR_DRAG),
        (Part.QUADRATIC_DRAG, "quadratic", numbers.QUADRATIC_DRAG),
    ):
        if part in nominal:
            for i in np.flatnonzero(values):
                place = (i, i) if field != "quadratic" else i
                out.append(Uncertain(f"hull.{part.value}.{_AXES[i]}", _scale(field, place)))
    return out


def _scale(field: str, place) -> Callable[[Vehicle, float], Vehicle]:
    def moved(vehicle: Vehicle, z: float) -> Vehicle:
        value = getattr(vehicle, field).copy()
        index = (slice(None), *place) if isinstance(place, tuple) else (slice(None), place)
        value[index] *= 1 + RELATIVE * z
        return vehicle.replaced(**{field: value})

    return moved


def _shift(axis: int) -> Callable[[Vehicle, float], Vehicle]:
    def moved(vehicle: Vehicle, z: float) -> Vehicle:
        centre = vehicle.centre.copy()
        centre[:, axis] += CENTRE * z
        return vehicle.replaced(centre=centre)

    return moved


_AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
_UNITS = {
    "added_mass": ("kg", "kg m^2"),
    "linear_drag": ("N s/m", "N m s/rad"),
    "quadratic_drag": ("N s^2/m^2", "N m s^2/rad^2"),
}


@dataclass(frozen=True)
class Hidden:
    """A part that the nominal lacks, with the truth's numbers of it."""

    part: Part
    values: np.ndarray
    #: Whether a fitted entry of the catalogue has the same meaning, so that its error may be scored.
    comparable: bool = True

    def put(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle with it, in the truth's own form."""
        v = self.values
        if self.part is Part.ADDED_MASS:
            return vehicle.replaced(added=_coupled(v, _ADDED)[None])
        if self.part is Part.LINEAR_DRAG:
            return vehicle.replaced(linear=_coupled(v, _LINEAR)[None])
        if self.part is Part.QUADRATIC_DRAG:
            return vehicle.replaced(quadratic=v[None], power=0.9, mixed=0.15)
        if self.part is Part.BUOYANCY_OFFSET:
            return vehicle.replaced(buoyancy_centre=vehicle.centre * 0 + v)
        if self.part is Part.NET_BUOYANCY:
            return vehicle.replaced(buoyancy=np.array([[numbers.MASS * numbers.GRAVITY + v[0]]]), squeeze=4e-4)
        return vehicle.replaced(current=v[None], wander=0.03)

    def plain(self, vehicle: Vehicle) -> Vehicle:
        """A vehicle that has it, with the catalogue's form of it and the same numbers."""
        diagonal = lambda matrix: matrix * np.eye(6)  # noqa: E731
        if self.part is Part.ADDED_MASS:
            return vehicle.replaced(added=diagonal(vehicle.added))
        if self.part is Part.LINEAR_DRAG:
            return vehicle.replaced(linear=diagonal(vehicle.linear))
        if self.part is Part.QUADRATIC_DRAG:
            return vehicle.replaced(power=1.0, mixed=0.0)
        if self.part is Part.NET_BUOYANCY:
            return vehicle.replaced(squeeze=0.0)
        return vehicle.replaced(wander=0.0) if self.part is Part.CURRENT else vehicle

    def parameters(self) -> list[dict]:
        """Its numbers as an answer has them: name, value, unit."""
        kind = self.part.value
        if kind in _UNITS:
            named = [(_AXES[i], self.values[i], _UNITS[kind][i // 3]) for i in np.flatnonzero(self.values)]
        elif self.part is Part.NET_BUOYANCY:
            named = [("force", self.values[0], "N")]
        else:
            unit = "m" if self.part is Part.BUOYANCY_OFFSET else "m/s"
            named = [(axis, value, unit) for axis, value in zip("xyz", self.values)]
        return [{"name": name, "value": float(value), "unit": unit} for name, value, unit in named]


def draw(part: Part, rng: np.random.Generator) -> Hidden:
    """A part with numbers about the public ones."""
    vary = lambda values: values * rng.uniform(0.85, 1.15, len(values))  # noqa: E731
    if part is Part.ADDED_MASS:
        return Hidden(part, vary(numbers.ADDED_MASS))
    if part is Part.LINEAR_DRAG:
        return Hidden(part, vary(numbers.LINEAR_DRAG))
    if part is Part.QUADRATIC_DRAG:
        return Hidden(part, vary(numbers.QUADRATIC_DRAG))
    if part is Part.BUOYANCY_OFFSET:
        # In the frame of the hull, which the weight may be off by a millimetre.
        return Hidden(part, numbers.BUOYANCY_CENTRE * rng.uniform(0.9, 1.5) + rng.normal(0, [0.002, 0.001, 0.0]))
    if part is Part.NET_BUOYANCY:
        # A pilot trims it light with a float of a few hundred grams, or it carries a tool.
        return Hidden(part, np.array([rng.choice([1.0, 1.0, -1.0]) * rng.uniform(2.5, 6.0)]))
    way = rng.uniform(0, 2 * np.pi)
    size = rng.uniform(0.08, 0.2)
    return Hidden(part, size * np.array([np.cos(way), np.sin(way), rng.normal(0, 0.05)]))


def without(vehicle: Vehicle, part: Part) -> Vehicle:
    """The vehicle without a part. Without an offset the buoyancy pulls at the hull's nominal centre of mass."""
    if part is Part.ADDED_MASS:
        return vehicle.replaced(added=np.zeros((1, 6, 6)))
    if part is Part.LINEAR_DRAG:
        return vehicle.replaced(linear=np.zeros((1, 6, 6)))
    if part is Part.QUADRATIC_DRAG:
        return vehicle.replaced(quadratic=np.zeros((1, 6)), power=1.0, mixed=0.0)
    if part is Part.BUOYANCY_OFFSET:
        return vehicle.replaced(buoyancy_centre=np.zeros((1, 3)))
    if part is Part.NET_BUOYANCY:
        return vehicle.replaced(buoyancy=np.array([[numbers.MASS * numbers.GRAVITY]]), squeeze=0.0)
    return vehicle.replaced(current=np.zeros((1, 3)), wander=0.0)


def small(part: Part) -> list[Callable[[Vehicle, float], Vehicle]]:
    """Ways to move each coefficient of a part a little: (vehicle, part of its public value) -> vehicle."""

    def field(name: str, place, size: float):
        def moved(vehicle: Vehicle, amount: float) -> Vehicle:
            value = getattr(vehicle, name).copy()
            value[(slice(None), *place)] += amount * size
            return vehicle.replaced(**{name: value})

        return moved

    if part is Part.ADDED_MASS:
        return [field("added", (i, i), a) for i, a in enumerate(numbers.ADDED_MASS)]
    if part is Part.LINEAR_DRAG:
        sizes = (13.7, 13.7, 33.0, 0.8, 0.8, 0.8)
        return [field("linear", (i, i), d) for i, d in enumerate(sizes)]
    if part is Part.QUADRATIC_DRAG:
        return [field("quadratic", (i,), d) for i, d in enumerate(numbers.QUADRATIC_DRAG)]
    if part is Part.BUOYANCY_OFFSET:
        return [field("buoyancy_centre", (i,), 0.01) for i in range(3)]
    if part is Part.NET_BUOYANCY:
        return [field("buoyancy", (0,), 3.0)]
    return [field("current", (i,), 0.1) for i in range(3)]


def perturbed(nominal: frozenset[Part], rng: np.random.Generator, configuration: str) -> tuple[Vehicle, dict]:
    """The vehicle of a nominal with its uncertain numbers off, and by how much [standard deviations]."""
    vehicle = fossen.public(configuration)
    for part in Part:
        if part not in nominal:
            vehicle = without(vehicle, part)
    amounts = {}
    for number in uncertain(nominal, configuration):
        z = float(np.clip(rng.normal(), -CUT, CUT))
        vehicle = number.moved(vehicle, z)
        amounts[number.name] = z
    return vehicle, amounts


def _coupled(diagonal: np.ndarray, fractions: dict) -> np.ndarray:
    """A symmetric matrix [6, 6] with this diagonal and fractions of its geometric means beside it."""
    matrix = np.diag(diagonal).astype(float)
    for (i, j), part in fractions.items():
        matrix[i, j] = matrix[j, i] = part * np.sqrt(diagonal[i] * diagonal[j])
    return matrix
