"""The base class of the hidden effects: the hooks that the plant calls."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..plant import Plant


class Effect:
    """One effect on one target. `scale` [M, 1] multiplies its magnitude, so that members may differ.

    `parameters` are the values at scale 1: name -> (value, unit). `comparable` says whether a fitted
    catalogue entry of the same name has the same meaning, so that its error may be scored.
    """

    kind = "?"
    moves_water = False
    implicit = False
    #: Force [M] N m at the start of a step less its mean over it, on the velocity `dof`; none where it is the same.
    varies = None
    #: Smallest and largest factor on the base parameters that are still physical.
    least, most = 0.0, 30.0

    def __init__(self, target: str, parameters: dict[str, tuple[float, str]], *, comparable: bool = True):
        self.target, self.parameters, self.comparable = target, parameters, comparable
        self.scale = np.ones((1, 1))
        self._sums: dict[str, list[float]] = {}

    def note(self, names, plain: np.ndarray, given: np.ndarray) -> None:
        """Remember what the catalogue's form with coefficient 1 gives, and what this effect gave, [M, len(names)]."""
        cross, square = (plain * given).sum(0), (plain * plain).sum(0)
        for i, name in enumerate(names):
            sums = self._sums.setdefault(name, [0.0, 0.0])
            sums[0] += cross[i]
            sums[1] += square[i]

    def forget(self) -> None:
        """Drop what was noted."""
        self._sums = {}

    def equivalent(self, factor: float) -> dict[str, tuple[float, str]]:
        """The parameters of the catalogue's form that come nearest over what was noted (least squares)."""
        values = self.scaled_parameters(factor)
        for name, (cross, square) in self._sums.items():
            if name in values and square > 0:
                values[name] = (float(cross / square), values[name][1])
        return values

    def value(self, name: str) -> float:
        """A parameter at scale 1."""
        return self.parameters[name][0] if name in self.parameters else 0.0

    def vector(self, *names: str) -> np.ndarray:
        """Parameters at scale 1, absent ones zero."""
        return np.array([self.value(name) for name in names])

    def scaled_parameters(self, factor: float) -> dict[str, tuple[float, str]]:
        """Parameters at a scale; what does not scale (a rate, a length) overrides this."""
        fixed = self.fixed()
        return {
            name: (value if name in fixed else value * factor, unit) for name, (value, unit) in self.parameters.items()
        }

    def fixed(self) -> set[str]:
        """Parameters that the scale leaves alone."""
        return set()

    def parts(self) -> list["Effect"]:
        """Effects of the same kind that together span what its coefficients can do."""
        return [self]

    def begin(self, plant: "Plant") -> None:
        """Allocate memory for the members."""

    def command(self, plant: "Plant", asked: np.ndarray) -> np.ndarray:
        """Commands [M, nu] as they arrive at the actuators."""
        return asked

    def force(self, plant: "Plant") -> None:
        """Add wrenches and joint forces."""

    def water_velocity(self, plant: "Plant") -> np.ndarray:
        """Velocity of the water in the world [M, 3] m/s."""
        return np.zeros((plant.members, 3))

    def read(self, plant: "Plant", sensors: np.ndarray) -> None:
        """Change readings [M, ns] of the present state that are of something the engine does not have."""

    def sense(self, readings: "Readings") -> None:
        """Change what is reported."""


class Readings:
    """Readings of one trial on a fine grid: `times` [T] s, `values` [T, ns], named columns."""

    def __init__(self, times: np.ndarray, values: np.ndarray, columns: dict[str, slice], quaternions: set[str]):
        self.times, self.values, self.columns, self.quaternions = times, values, columns, quaternions


#: The six directions of a body, in the order of a wrench.
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def drag_units(power: int) -> tuple[str, str]:
    """Units of a linear (1) or quadratic (2) drag coefficient of force and of torque."""
    return ("N s/m", "N m s/rad") if power == 1 else ("N s^2/m^2", "N m s^2/rad^2")


def one_by_one(values: np.ndarray) -> list[np.ndarray]:
    """The non-zero components of a vector, each in a vector of its own."""
    values = np.asarray(values, float)
    return [np.where(np.arange(len(values)) == i, values, 0.0) for i in np.flatnonzero(values)]


def six(values: np.ndarray, units: tuple[str, str]) -> dict[str, tuple[float, str]]:
    """Six named numbers, zeros left out."""
    return {axis: (float(v), units[i // 3]) for i, (axis, v) in enumerate(zip(AXES, values)) if v != 0.0}
