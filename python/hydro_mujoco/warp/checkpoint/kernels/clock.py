"""When a sample of a checkpoint is due in each world, and its features: Warp kernels (src/plugin/learned_wrench).

There is no hook at a step's end, so the memory follows the clock: the first evaluation after the time went on takes the
state as that of the step's end. Where the time went back or jumped, the world starts anew.
"""

import warp as wp

from ...arrays import Arrays
from ...sea import flow_at
from ..lanes import LANES
from ..robot import Reading

wp.set_module_options({"enable_backward": False})

COLD, WARM, FAULTED = wp.constant(0), wp.constant(1), wp.constant(2)
#: Kinds of features, as in robot.py.
POSITION, VELOCITY, QUATERNION = wp.constant(0), wp.constant(1), wp.constant(2)
ANGULAR, LINEAR = wp.constant(3), wp.constant(4)
#: Distance of a step from a sample that still counts as on it, as a part of the sample period.
ON_SAMPLE = wp.constant(wp.float64(1e-6))


@wp.func
def attitude_of(r: Reading, qpos: wp.array2d[float], world: int) -> wp.quat:
    """The base's attitude, world from base."""
    if r.free_qpos < 0:
        return r.attitude
    at = r.free_qpos + 3
    turn = wp.quat(qpos[world, at + 1], qpos[world, at + 2], qpos[world, at + 3], qpos[world, at])
    if wp.length(turn) < 1.0e-30:
        return wp.quat(0.0, 0.0, 0.0, 1.0)
    return wp.normalize(turn)


@wp.func
def part_of(turn: wp.quat, component: int) -> float:
    """Component w x y z of a quaternion."""
    if component == 0:
        return turn[3]
    return turn[component - 1]


@wp.func
def base_velocity(r: Reading, qvel: wp.array2d[float], world: int) -> wp.vec3:
    """Velocity of the base's origin [m/s], world."""
    if r.free_dof >= 0:
        return wp.vec3(qvel[world, r.free_dof], qvel[world, r.free_dof + 1], qvel[world, r.free_dof + 2])
    velocity = wp.vec3(0.0, 0.0, 0.0)
    for slide in range(r.slide_dof.shape[0]):
        velocity += qvel[world, r.slide_dof[slide]] * r.slide_axis[slide]
    return velocity


@wp.func
def value_of(
    r: Reading,
    i: int,
    qpos: wp.array2d[float],
    qvel: wp.array2d[float],
    world: int,
    turn: wp.quat,
    linear: wp.vec3,
) -> float:
    """A feature; linear: velocity through the water, base frame [m/s]."""
    kind, place = r.kind[i], r.place[i]
    if kind == POSITION:
        return qpos[world, place]
    if kind == VELOCITY:
        return qvel[world, place]
    if kind == QUATERNION:
        return part_of(turn, place)
    if kind == ANGULAR:
        if r.free_dof < 0:
            return 0.0
        return qvel[world, r.free_dof + 3 + place]
    if kind == LINEAR:
        return linear[place]
    return r.density


@wp.kernel
def take_samples(
    option_timestep: wp.array[float],
    time: wp.array[float],
    qpos: wp.array2d[float],
    qvel: wp.array2d[float],
    xpos: wp.array2d[wp.vec3],
    a: Arrays,
    gust: wp.array2d[wp.vec3],
    r: Reading,
    period: wp.float64,
    # Memory
    phase: wp.array[int],
    is_first: wp.array[int],
    latest: wp.array[float],
    since: wp.array[wp.float64],
    present: wp.array3d[float],
    previous: wp.array3d[float],
    # Out
    sample: wp.array3d[float],
    starts: wp.array3d[float],
    due: wp.array3d[float],
):
    """Marks the worlds where a sample is due, or a first one, and leaves its features.

    is_first: 1 while no step has followed the first sample. since: time from the latest sample [s]. present, previous:
    features now, and at the end of the step before. sample: features at the sample, between the two.
    """
    world = wp.tid()
    group, lane = world // LANES, world % LANES
    starts[group, 0, lane] = 0.0
    due[group, 0, lane] = 0.0
    now = time[world]
    step = option_timestep[world % option_timestep.shape[0]]
    passed = now - latest[world]
    state = phase[world]
    begins = state == COLD or passed < -0.5 * step or (state == WARM and passed > 1.5 * step)
    follows = (not begins) and state == WARM and passed > 0.5 * step
    # A simulation is often moved before its first step.
    again = (not begins) and state == WARM and (not follows) and is_first[world] == 1
    latest[world] = now
    if not (begins or follows or again):
        return

    turn = attitude_of(r, qpos, world)
    place = xpos[world, r.body]
    if r.free_qpos >= 0:
        place = wp.vec3(qpos[world, r.free_qpos], qpos[world, r.free_qpos + 1], qpos[world, r.free_qpos + 2])
    flow = flow_at(a, world, r.water, place, now, gust[world, r.water])
    linear = wp.quat_rotate_inv(turn, base_velocity(r, qvel, world) - flow.velocity)
    agreement = turn[3]
    if follows and r.quaternion >= 0:
        agreement = float(0.0)
        for i in range(4):
            agreement += part_of(turn, i) * previous[group, r.quaternion + i, lane]
    if agreement < 0.0:
        turn = -turn

    is_finite = bool(True)
    is_same = bool(again)
    for i in range(r.kind.shape[0]):
        value = value_of(r, i, qpos, qvel, world, turn, linear)
        is_finite = is_finite and wp.isfinite(value)
        is_same = is_same and value == previous[group, i, lane]
        present[group, i, lane] = value
    if not is_finite:
        phase[world] = FAULTED
        return
    if is_same:
        return

    part = float(1.0)
    if follows:
        is_first[world] = 0
        passed_since = since[world] + wp.float64(step)
        late = passed_since - period
        since[world] = passed_since
        if late >= -ON_SAMPLE * period:
            due[group, 0, lane] = 1.0
            # On the sample its time is the simulation's own, so that rounding never piles up.
            since[world] = wp.float64(0.0)
            if late > ON_SAMPLE * period:
                since[world] = late
                part = 1.0 - float(late) / step
    else:
        phase[world] = WARM
        is_first[world] = 1
        since[world] = wp.float64(0.0)
        starts[group, 0, lane] = 1.0
        due[group, 0, lane] = 1.0
    if due[group, 0, lane] > 0.0:
        length = float(0.0)
        for i in range(r.kind.shape[0]):
            value = present[group, i, lane]
            if part < 1.0:
                value = previous[group, i, lane] + part * (value - previous[group, i, lane])
            if r.kind[i] == QUATERNION:
                length += value * value
            sample[group, i, lane] = value
        if part < 1.0 and r.quaternion >= 0:
            for i in range(r.quaternion, r.quaternion + 4):
                sample[group, i, lane] /= wp.max(wp.sqrt(length), 1.0e-30)
    for i in range(r.kind.shape[0]):
        previous[group, i, lane] = present[group, i, lane]
