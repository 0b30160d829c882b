"""The effects of all instances as numbers: a row a body of an instance."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from ..errors import DataError
from ..recording.kinematics import name_of
from ..sea.waves import Waves
from .hull import NO_HULL, BodyHull, Hull, hull, own_volume, robot_hulls
from .instances import Instance, instances, target_body
from .support import refuse
from .swell import bodies_in_waves

#: Hulls of so many of their lengths in a wave are short beside it: the surface is a plane over them.
LONG_HULL = 5
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def moved(point: np.ndarray) -> np.ndarray:
    """[6, 6] that takes a velocity (linear, angular) of the body's origin to that of a point [m]: v + omega x r."""
    x, y, z = point
    matrix = np.eye(6)
    matrix[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return matrix


@dataclass
class Row:
    """The water of an instance on one body; six numbers are those of force and torque, or linear and angular motion.

    Attributes:
        body: its number. water: number of the instance. hull: its sizes.
        added_mass: about the body's origin [kg, kg m, kg m^2], shape (6, 6). linear_drag: likewise.
        quadratic_drag: about `quadratic_point` [m], row by force, column by the velocity that is squared, shape (6, 6).
        cross_flow: half density times coefficient times breadth for flow along the two axes after the longest one
            [kg/m^2], shape (2,). lift: half density times area times slope [kg/m], shape (2,).
        munk: [kg], shape (2,).
        up_force: net buoyancy [N]. up_moment: [N m]. offset: displaced mass times the way of its centre [kg m].
        world_force, world_torque: constant in the world [N], [N m].
        displaced: mass of the water in the whole hull of hydrostatics [kg]; 0 without.
        floats: True where hydrostatics acts.
        carried: mass of the water that waves push the body with where hydrostatics does not act [kg].
        wake: drag of what the wake remembers [N s/m, N m s/rad], shape (6,). wake_rate: of forgetting [1/s].
        basset: of a history force [kg/s^0.5], shape (3,).
    """

    body: int
    water: int
    hull: Hull
    added_mass: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    linear_drag: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    quadratic_drag: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    quadratic_point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    cross_flow: np.ndarray = field(default_factory=lambda: np.zeros(2))
    lift: np.ndarray = field(default_factory=lambda: np.zeros(2))
    munk: np.ndarray = field(default_factory=lambda: np.zeros(2))
    up_force: float = 0.0
    up_moment: np.ndarray = field(default_factory=lambda: np.zeros(3))
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    world_force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    world_torque: np.ndarray = field(default_factory=lambda: np.zeros(3))
    displaced: float = 0.0
    floats: bool = False
    carried: float = 0.0
    wake: np.ndarray = field(default_factory=lambda: np.zeros(6))
    wake_rate: float = 0.0
    basset: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def long_axis(self) -> int:
        """The axis along which strips of cross-flow drag lie: the longest, x before y before z."""
        return int(np.argmax(self.hull.extent))

    @property
    def may_push(self) -> bool:
        """True where its damping may have a negative eigenvalue."""
        couplings = self.quadratic_drag - np.diag(np.diag(self.quadratic_drag))
        return bool(np.any(couplings) or np.any(self.lift))


@dataclass(frozen=True)
class Water:
    """All that `attach` needs of a model: its instances, a row a body of each, the current of effects.

    current: velocity that the effects of that name add everywhere, world [m/s], shape (3,).
    robots: of each instance, the hulls that its checkpoint's force fades with; none without a surface.
    """

    instances: list[Instance]
    rows: list[Row]
    current: np.ndarray
    robots: list[list[BodyHull]]


def water(model: mujoco.MjModel) -> Water:
    """The water of a compiled model.

    Raises:
        DataError: it has none, or something of it that MuJoCo Warp does not get.
    """
    found = instances(model)
    rows: dict[tuple[int, int], Row] = {}
    current = np.zeros(3)
    for number, instance in enumerate(found):
        for effect in instance.effects:
            values = effect["parameters"]
            if effect["effect"] == "current":
                current += [values["x"], values["y"], values["z"]]
                continue
            body = target_body(model, effect, f"instance `{instance.name}`")
            if (number, body) not in rows:
                rows[number, body] = Row(body, number, hull(model, body, instance))
            _PUT[effect["effect"]](rows[number, body], values, instance.density)
    for number, instance in enumerate(found):
        if instance.waves is not None:
            _into_waves(model, number, instance, instance.waves, rows)
        if instance.learned is not None and (number, instance.body) not in rows:
            # No effect acts on it, so its sizes do not count.
            rows[number, instance.body] = Row(instance.body, number, NO_HULL)
    if np.any(current) and (model.opt.density > 0 or model.opt.viscosity > 0):
        raise DataError(
            "effect `current` beside MuJoCo's own fluid (option density or viscosity above 0) is not supported in "
            "MuJoCo Warp; give the attribute `current`, or `option wind`"
        )
    fades = [instance.learned is not None and instance.waterline is not None for instance in found]
    robots = [robot_hulls(model, instance) if fade else [] for instance, fade in zip(found, fades, strict=True)]
    return Water(found, list(rows.values()), current, robots)


def _into_waves(
    model: mujoco.MjModel, number: int, instance: Instance, waves: Waves, rows: dict[tuple[int, int], Row]
) -> None:
    """Let waves push what displaces water and does not float by hydrostatics, as the plugin does."""
    floating = [row for (water, _), row in rows.items() if water == number and row.floats]
    for row in floating:
        shortest, longest = waves.shortest_length, LONG_HULL * row.hull.extent.max()
        if longest > shortest:
            refuse(
                f"instance `{instance.name}`, body `{name_of(model, row.body)}`",
                f"a wave of {shortest:.3g} m over a hull of {row.hull.extent.max():.3g} m",
                (f"waves of {longest:.3g} m and longer",),
            )
    welded = {int(model.body_weldid[row.body]) for row in floating}
    for body in bodies_in_waves(model, instance):
        if int(model.body_weldid[body]) in welded:
            continue
        if (number, body) not in rows:
            rows[number, body] = Row(body, number, hull(model, body, instance, is_known=False))
        given = instance.volume if body == instance.body else None
        rows[number, body].carried = instance.density * (
            own_volume(model, body, instance.density) if given is None else given
        )


def _at_point(row: Row, values: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """A whole matrix and its point, or a diagonal and the hull's middle."""
    point = np.array(values.get("point", row.hull.middle), dtype=float)
    if "matrix" in values:
        return np.array(values["matrix"], dtype=float), point
    return np.diag([float(values[axis]) for axis in AXES]), point


def _about_origin(row: Row, values: dict[str, Any]) -> np.ndarray:
    """The same for motions and forces at the body's origin."""
    matrix, point = _at_point(row, values)
    return moved(point).T @ matrix @ moved(point)


def _added_mass(row: Row, values: dict[str, Any], density: float) -> None:
    matrix = _about_origin(row, values)
    row.added_mass = (matrix + matrix.T) / 2


def _linear_drag(row: Row, values: dict[str, Any], density: float) -> None:
    row.linear_drag = _about_origin(row, values)


def _quadratic_drag(row: Row, values: dict[str, Any], density: float) -> None:
    row.quadratic_drag, row.quadratic_point = _at_point(row, values)


def _cross_flow_drag(row: Row, values: dict[str, Any], density: float) -> None:
    first, second = (row.long_axis + 1) % 3, (row.long_axis + 2) % 3
    breadths = row.hull.extent[[second, first]]
    coefficients = np.array([float(values[AXES[axis]]) for axis in (first, second)])
    row.cross_flow = 0.5 * density * coefficients * breadths


def _munk_moment(row: Row, values: dict[str, Any], density: float) -> None:
    row.munk = np.array([values["pitch"], values["yaw"]], dtype=float)


def _lift(row: Row, values: dict[str, Any], density: float) -> None:
    x, y, z = row.hull.extent
    row.lift = 0.5 * density * np.array([values["sway"] * x * z, values["heave"] * x * y])


def _net_buoyancy(row: Row, values: dict[str, Any], density: float) -> None:
    row.up_force = float(values["force"])
    row.up_moment = np.array([float(values.get(f"moment_{axis}", 0)) for axis in "xyz"])


def _buoyancy_offset(row: Row, values: dict[str, Any], density: float) -> None:
    row.offset = density * row.hull.displaced * np.array([float(values[axis]) for axis in "xyz"])


def _hydrostatics(row: Row, values: dict[str, Any], density: float) -> None:
    row.displaced, row.floats = density * float(values.get("volume", row.hull.volume)), True


def _constant_force(row: Row, values: dict[str, Any], density: float) -> None:
    row.world_force = np.array([float(values[axis]) for axis in "xyz"])
    row.world_torque = np.array([float(values.get(f"torque_{axis}", 0)) for axis in "xyz"])


def _wake_memory(row: Row, values: dict[str, Any], density: float) -> None:
    row.wake, row.wake_rate = np.array([float(values[axis]) for axis in AXES]), float(values["rate"])


def _basset_history(row: Row, values: dict[str, Any], density: float) -> None:
    row.basset = np.array([float(values[axis]) for axis in AXES[:3]])


#: Effect on a body -> what puts its values into a row; the plugin takes each once a body.
_PUT: dict[str, Callable[[Row, dict[str, Any], float], None]] = {
    "added_mass": _added_mass,
    "linear_drag": _linear_drag,
    "quadratic_drag": _quadratic_drag,
    "cross_flow_drag": _cross_flow_drag,
    "munk_moment": _munk_moment,
    "lift": _lift,
    "net_buoyancy": _net_buoyancy,
    "buoyancy_offset": _buoyancy_offset,
    "hydrostatics": _hydrostatics,
    "constant_force": _constant_force,
    "wake_memory": _wake_memory,
    "basset_history": _basset_history,
}
