"""The water's numbers on the device."""

from collections.abc import Callable

import mujoco
import numpy as np
import warp as wp

from ..sea.waves import Waves
from .hull import hull_centre
from .rows import Row, Water
from .solids import Solid

wp.set_module_options({"enable_backward": False})


#: Bed of deep water [m]: below it waves no longer change.
LOWEST = -1e5


@wp.struct
class Arrays:
    """The water's numbers. A row is a body in the water of an instance; a water is an instance's.

    Arrays of two dimensions are what may differ from world to world: their first is 1, or the number of worlds.
    """

    # By row.
    body: wp.array[int]
    dof: wp.array[int]  # last degree of freedom that moves the body
    water: wp.array[int]
    is_root: wp.array[bool]  # its centre of mass is that of its tree
    has_room: wp.array[bool]  # M has room for products of its degrees of freedom
    may_push: wp.array[bool]
    com: wp.array[wp.vec3]  # centre of mass, body frame [m]
    middle: wp.array[wp.vec3]
    centre: wp.array[wp.vec3]  # of the whole hull, or of buoyancy
    centre_is_given: wp.array[bool]
    hull_volume: wp.array[float]
    hull_centre: wp.array[wp.vec3]
    carried: wp.array[
        float
    ]  # mass of the water that waves push a body with where it does not float by hydrostatics [kg]
    long_axis: wp.array[int]
    length: wp.array[float]
    solid_start: wp.array[int]  # number of rows and one more
    quadratic_point: wp.array[wp.vec3]
    added_mass: wp.array2d[wp.spatial_matrix]
    linear_drag: wp.array2d[wp.spatial_matrix]
    quadratic_drag: wp.array2d[wp.spatial_matrix]
    cross_flow: wp.array2d[wp.vec2]
    lift: wp.array2d[wp.vec2]
    munk: wp.array2d[wp.vec2]
    up_force: wp.array2d[float]
    up_moment: wp.array2d[wp.vec3]
    offset: wp.array2d[wp.vec3]
    world_force: wp.array2d[wp.vec3]
    world_torque: wp.array2d[wp.vec3]
    displaced: wp.array2d[float]
    wake: wp.array2d[wp.spatial_vector]
    wake_rate: wp.array2d[float]
    basset: wp.array2d[wp.vec3]
    # By water.
    has_surface: wp.array[bool]
    waterline: wp.array[float]
    current: wp.array2d[wp.vec3]
    gust_deviation: wp.array2d[wp.vec3]
    gust_seed: wp.array2d[wp.uint64]
    gust_time: wp.array[float]  # constant of the gusts [s]
    profile_start: wp.array[int]
    wave_start: wp.array[int]
    bed: wp.array[float]  # height above the still level [m]
    robot_start: wp.array[int]  # number of waters and one more
    # Bodies of a robot whose checkpoint fades at the surface.
    robot_body: wp.array[int]
    robot_centre: wp.array[wp.vec3]  # of its whole hull
    robot_volume: wp.array[float]
    robot_solid_start: wp.array[int]  # number of them and one more
    # By point of a profile, by wave, by solid, by corner of triangles.
    profile_depth: wp.array[float]
    profile_velocity: wp.array[wp.vec3]
    wave_amplitude: wp.array[float]
    wave_frequency: wp.array[float]
    wave_phase: wp.array[float]
    wave_number: wp.array[wp.vec2]
    wave_upward: wp.array[float]
    wave_pressure: wp.array[float]
    solid_centre: wp.array[wp.vec3]
    solid_axes: wp.array[wp.mat33]
    solid_kind: wp.array[int]
    solid_size: wp.array[wp.vec3]
    triangle_start: wp.array[int]  # number of solids and one more
    corners: wp.array[wp.vec3]


#: Fields that may differ from world to world, with their Warp types.
BY_WORLD = {
    "added_mass": wp.spatial_matrix,
    "linear_drag": wp.spatial_matrix,
    "quadratic_drag": wp.spatial_matrix,
    "cross_flow": wp.vec2,
    "lift": wp.vec2,
    "munk": wp.vec2,
    "up_force": float,
    "up_moment": wp.vec3,
    "offset": wp.vec3,
    "world_force": wp.vec3,
    "world_torque": wp.vec3,
    "displaced": float,
    "wake": wp.spatial_vector,
    "wake_rate": float,
    "basset": wp.vec3,
}
#: Those of effects that remember the motion.
REMEMBERING = ("wake", "wake_rate", "basset")
#: The same by water in place of row.
BY_WATER = {"current": wp.vec3, "gust_deviation": wp.vec3, "gust_seed": wp.uint64}


def arrays(model: mujoco.MjModel, water: Water, device: wp.Device) -> Arrays:
    """The numbers of a model's water, on a device."""

    def put(values: object, dtype: type) -> wp.array:
        return wp.array(np.array(values), dtype=dtype, device=device)

    rows, parts = water.rows, [part for robot in water.robots for part in robot]
    hulls = [row.hull.solids for row in rows] + [part.solids for part in parts]
    starts = _starts([len(solids) for solids in hulls])
    given = [_centre_is_given(row, water) for row in rows]
    out = Arrays()
    out.body = put([row.body for row in rows], int)
    out.dof = put([dofs(model, row.body)[-1] for row in rows], int)
    out.water = put([row.water for row in rows], int)
    out.is_root = put([model.body_rootid[row.body] == row.body for row in rows], bool)
    out.has_room = put([has_room(model, row.body) for row in rows], bool)
    out.may_push = put([row.may_push for row in rows], bool)
    out.com = put([model.body_ipos[row.body] for row in rows], wp.vec3)
    out.middle = put([row.hull.middle for row in rows], wp.vec3)
    out.centre = put([row.hull.centre for row in rows], wp.vec3)
    out.centre_is_given = put(given, bool)
    out.hull_volume = put([sum(solid.volume for solid in row.hull.solids) for row in rows], float)
    out.hull_centre = put([hull_centre(row.hull.solids, row.hull.centre) for row in rows], wp.vec3)
    out.carried = put([row.carried for row in rows], float)
    out.long_axis = put([row.long_axis for row in rows], int)
    out.length = put([row.hull.extent.max() for row in rows], float)
    out.solid_start = put(starts[: len(rows) + 1], int)
    out.quadratic_point = put([row.quadratic_point for row in rows], wp.vec3)
    for name, dtype in BY_WORLD.items():
        setattr(out, name, put([[getattr(row, name) for row in rows]], dtype))
    _put_currents(out, model, water, put)
    _put_waves(out, [instance.waves for instance in water.instances], put)
    _put_solids(out, [solid for solids in hulls for solid in solids], put)
    out.robot_start = put(_starts([len(robot) for robot in water.robots]), int)
    out.robot_body = put(np.array([part.body for part in parts], dtype=int), int)
    centres = [hull_centre(part.solids, np.zeros(3)) for part in parts]
    out.robot_centre = put(np.reshape(centres, (-1, 3)), wp.vec3)
    out.robot_volume = put([sum(solid.volume for solid in part.solids) for part in parts], float)
    out.robot_solid_start = put(starts[len(rows) :], int)
    return out


def _put_currents(out: Arrays, model: mujoco.MjModel, water: Water, put: Callable[[object, type], wp.array]) -> None:
    waters = water.instances
    has_fluid = model.opt.density > 0 or model.opt.viscosity > 0
    common = water.current + (model.opt.wind if has_fluid else 0.0)
    currents = [instance.current for instance in waters]
    out.has_surface = put([instance.waterline is not None for instance in waters], bool)
    out.waterline = put([instance.waterline or 0.0 for instance in waters], float)
    out.current = put([[common + each.uniform for each in currents]], wp.vec3)
    out.gust_deviation = put([[each.deviation for each in currents]], wp.vec3)
    out.gust_seed = put([[each.seed for each in currents]], wp.uint64)
    out.gust_time = put([each.time_constant for each in currents], float)
    out.profile_start = put(_starts([len(each.depth) for each in currents]), int)
    out.profile_depth = put(np.concatenate([each.depth for each in currents]), float)
    out.profile_velocity = put(np.concatenate([each.velocity for each in currents]), wp.vec3)


def _put_waves(out: Arrays, seas: list[Waves | None], put: Callable[[object, type], wp.array]) -> None:
    there = [waves for waves in seas if waves is not None]

    def each(read: Callable[[Waves], np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
        return np.concatenate([np.zeros((0, *shape)), *(read(waves) for waves in there)])

    out.wave_start = put(_starts([0 if waves is None else len(waves.amplitude) for waves in seas]), int)
    out.bed = put([max(-np.inf if waves is None else -waves.depth, LOWEST) for waves in seas], float)
    out.wave_amplitude = put(each(lambda waves: waves.amplitude, ()), float)
    out.wave_frequency = put(each(lambda waves: waves.frequency, ()), float)
    out.wave_phase = put(each(lambda waves: waves.phase, ()), float)
    out.wave_number = put(each(lambda waves: waves.wavenumber, (2,)), wp.vec2)
    out.wave_upward = put(each(lambda waves: waves.upward, ()), float)
    out.wave_pressure = put(each(lambda waves: waves.pressure_scale, ()), float)


def _put_solids(out: Arrays, solids: list[Solid], put: Callable[[object, type], wp.array]) -> None:
    out.solid_centre = put(np.reshape([solid.centre for solid in solids], (-1, 3)), wp.vec3)
    out.solid_axes = put(np.reshape([solid.axes for solid in solids], (-1, 3, 3)), wp.mat33)
    out.solid_kind = put([solid.kind for solid in solids], int)
    out.solid_size = put(np.reshape([solid.size for solid in solids], (-1, 3)), wp.vec3)
    out.triangle_start = put(_starts([len(solid.triangles) for solid in solids]), int)
    out.corners = put(
        np.concatenate([np.zeros((0, 3)), *(solid.triangles.reshape(-1, 3) for solid in solids)]), wp.vec3
    )


def _starts(counts: list[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(int)


def dofs(model: mujoco.MjModel, body: int) -> list[int]:
    """The degrees of freedom that move a body, first to last."""
    while body and not model.body_dofnum[body]:
        body = int(model.body_parentid[body])
    dof = int(model.body_dofadr[body] + model.body_dofnum[body] - 1) if body else -1
    found: list[int] = []
    while dof >= 0:
        found.insert(0, dof)
        dof = int(model.dof_parentid[dof])
    return found


def has_room(model: mujoco.MjModel, body: int) -> bool:
    """True where MuJoCo's inertia matrix has room for products of all degrees of freedom that move a body."""
    return all(model.M_rownnz[dof] == above + 1 for above, dof in enumerate(dofs(model, body)))


def _centre_is_given(row: Row, water: Water) -> bool:
    instance = water.instances[row.water]
    return instance.body == row.body and instance.centre_of_buoyancy is not None
