"""From features to the numbers that a network reads: Warp kernel (crates/model/src/encoding.rs, envelope.rs)."""

import warp as wp

from ..lanes import LANES
from ..robot import Limits

wp.set_module_options({"enable_backward": False})

#: Greatest size of a feature in a closed form: no product of three leaves single precision.
FORM_LIMIT = wp.constant(1.0e9)
#: Bound of a standardised number [standard deviations] (crates/model/src/normaliser.rs).
INPUT_LIMIT = wp.constant(20.0)
HINGE, SLIDE = wp.constant(1), wp.constant(2)


@wp.struct
class Encoding:
    """How a sample is encoded and standardised. Places are among the features; -1: not there."""

    mean: wp.array[float]
    std: wp.array[float]
    has_up: bool  # the world's up direction in place of the quaternion
    has_forms: bool
    quaternion: int
    density: int
    linear: wp.array[int]
    angular: wp.array[int]
    joints: wp.array[int]
    base_linear: wp.array[int]  # of each axis
    base_angular: wp.array[int]
    parent: wp.array[int]  # by link; -1: the base
    origin: wp.array[wp.vec3]
    rotation: wp.array[wp.mat33]
    kind: wp.array[int]  # of the joint; 0 without
    position: wp.array[int]
    velocity: wp.array[int]
    axis: wp.array[wp.vec3]
    centre: wp.array[wp.vec3]
    along: wp.array[wp.vec3]


@wp.struct
class Frames:
    """Scratch by world and link: pose and velocity of its frame in the base's axes."""

    rotation: wp.array2d[wp.mat33]
    origin: wp.array2d[wp.vec3]
    linear: wp.array2d[wp.vec3]
    angular: wp.array2d[wp.vec3]


@wp.func
def put(e: Encoding, z: wp.array3d[float], group: int, lane: int, at: int, value: float) -> int:
    """Writes an encoded number, standardised; returns the place after it."""
    z[group, at, lane] = wp.clamp((value - e.mean[at]) / e.std[at], -INPUT_LIMIT, INPUT_LIMIT)
    return at + 1


@wp.func
def put_three(e: Encoding, z: wp.array3d[float], group: int, lane: int, at: int, scale: float, three: wp.vec3) -> int:
    """The same of a vector, times a scale."""
    after = int(at)
    for i in range(3):
        after = put(e, z, group, lane, after, scale * three[i])
    return after


@wp.func
def read(x: wp.array3d[float], group: int, lane: int, at: int) -> float:
    """A feature, bounded; 0 where it is not there."""
    if at < 0:
        return 0.0
    return wp.clamp(x[group, at, lane], -FORM_LIMIT, FORM_LIMIT)


@wp.func
def up_of(e: Encoding, x: wp.array3d[float], group: int, lane: int) -> wp.vec3:
    """The world's up direction in the base frame; of a zero quaternion, upright."""
    up = wp.vec3(0.0, 0.0, 1.0)
    if e.quaternion >= 0:
        w, i = x[group, e.quaternion, lane], x[group, e.quaternion + 1, lane]
        j, k = x[group, e.quaternion + 2, lane], x[group, e.quaternion + 3, lane]
        square = w * w + i * i + j * j + k * k
        if square > 1.0e-30:
            scale = 2.0 / square
            up = wp.vec3(scale * (i * k - w * j), scale * (j * k + w * i), 1.0 - scale * (i * i + j * j))
    return up


@wp.func
def norm_of(x: wp.array3d[float], group: int, lane: int, places: wp.array[int]) -> float:
    """Length of the vector of some features."""
    sum = float(0.0)
    for i in range(places.shape[0]):
        value = read(x, group, lane, places[i])
        sum += value * value
    return wp.sqrt(sum)


@wp.func
def body_forms(
    e: Encoding, x: wp.array3d[float], z: wp.array3d[float], group: int, lane: int, first: int, rho: float
) -> int:
    """Closed forms of the base and of the joints: quadratic drag, Coriolis forces, Munk and gyroscopic moments."""
    at = int(first)
    speed = norm_of(x, group, lane, e.linear)
    for i in range(e.linear.shape[0]):
        v = read(x, group, lane, e.linear[i])
        at = put(e, z, group, lane, at, rho * speed * v)
        at = put(e, z, group, lane, at, rho * wp.abs(v) * v)
        for j in range(e.angular.shape[0]):
            at = put(e, z, group, lane, at, rho * v * read(x, group, lane, e.angular[j]))
        for j in range(i + 1, e.linear.shape[0]):
            at = put(e, z, group, lane, at, rho * v * read(x, group, lane, e.linear[j]))
    rate = norm_of(x, group, lane, e.angular)
    for i in range(e.angular.shape[0]):
        w = read(x, group, lane, e.angular[i])
        at = put(e, z, group, lane, at, rho * rate * w)
        for j in range(i + 1, e.angular.shape[0]):
            at = put(e, z, group, lane, at, rho * w * read(x, group, lane, e.angular[j]))
    for i in range(e.joints.shape[0]):
        velocity = read(x, group, lane, e.joints[i])
        at = put(e, z, group, lane, at, rho * wp.abs(velocity) * velocity)
    return at


@wp.func
def move_link(e: Encoding, f: Frames, x: wp.array3d[float], world: int, group: int, lane: int, link: int):
    """Pose and velocity of a link's frame, from its parent's."""
    parent = e.parent[link]
    rotation = wp.identity(n=3, dtype=float)
    origin = wp.vec3(0.0, 0.0, 0.0)
    linear, angular = wp.vec3(0.0, 0.0, 0.0), wp.vec3(0.0, 0.0, 0.0)
    if parent >= 0:
        rotation = f.rotation[world, parent]
        origin = f.origin[world, parent]
        linear = f.linear[world, parent]
        angular = f.angular[world, parent]
    else:
        for i in range(3):
            linear[i] = read(x, group, lane, e.base_linear[i])
            angular[i] = read(x, group, lane, e.base_angular[i])
    arm = rotation * e.origin[link]
    rotation = rotation * e.rotation[link]
    origin = origin + arm
    linear = linear + wp.cross(angular, arm)
    if e.kind[link] != 0:
        q, rate = read(x, group, lane, e.position[link]), read(x, group, lane, e.velocity[link])
        axis = rotation * e.axis[link]
        if e.kind[link] == HINGE:
            rotation = rotation * wp.quat_to_matrix(wp.quat_from_axis_angle(e.axis[link], q))
            angular = angular + rate * axis
        else:
            origin = origin + q * axis
            linear = linear + q * wp.cross(angular, axis) + rate * axis
    f.rotation[world, link] = rotation
    f.origin[world, link] = origin
    f.linear[world, link] = linear
    f.angular[world, link] = angular


@wp.kernel
def encode(
    due: wp.array3d[float],
    sample: wp.array3d[float],
    e: Encoding,
    limits: Limits,
    f: Frames,
    # Out
    z: wp.array3d[float],
    drag: wp.array3d[float],
):
    """Encodes the sample where one is due: velocities are held to the range, and what is beyond it meets a drag."""
    world = wp.tid()
    group, lane = world // LANES, world % LANES
    if due[group, 0, lane] == 0.0:
        return
    for output in range(limits.drag_at.shape[0]):
        force = float(0.0)
        at = limits.drag_at[output]
        if at >= 0:
            value = sample[group, at, lane]
            share = (value - wp.clamp(value, limits.least[at], limits.most[at])) / limits.drag_width[output]
            size = wp.abs(share)
            grown = wp.where(size < 1.0, size * size, 2.0 * size - 1.0)
            force = -limits.drag_force[output] * grown * wp.sign(share)
        drag[group, output, lane] = force
    for i in range(limits.least.shape[0]):
        sample[group, i, lane] = wp.clamp(sample[group, i, lane], limits.least[i], limits.most[i])

    up = up_of(e, sample, group, lane)
    at = int(0)
    for i in range(limits.least.shape[0]):
        if e.has_up and i >= e.quaternion and i < e.quaternion + 4:
            if i == e.quaternion:
                at = put_three(e, z, group, lane, at, 1.0, up)
        else:
            at = put(e, z, group, lane, at, sample[group, i, lane])
    if not e.has_forms:
        return
    rho = float(1.0)
    if e.density >= 0:
        rho = read(sample, group, lane, e.density)
    if e.quaternion >= 0:
        at = put_three(e, z, group, lane, at, rho, up)
    at = body_forms(e, sample, z, group, lane, at, rho)
    for link in range(e.parent.shape[0]):
        move_link(e, f, sample, world, group, lane, link)
        rotation = f.rotation[world, link]
        arm = rotation * e.centre[link]
        centre = f.origin[world, link] + arm
        u = f.linear[world, link] + wp.cross(f.angular[world, link], arm)
        a = rotation * e.along[link]
        across = wp.length(u) * u
        ahead = wp.length(u) * wp.dot(u, a) * a
        at = put_three(e, z, group, lane, at, rho, across)
        at = put_three(e, z, group, lane, at, rho, wp.cross(centre, across))
        at = put_three(e, z, group, lane, at, rho, ahead)
        at = put_three(e, z, group, lane, at, rho, wp.cross(centre, ahead))
        at = put_three(e, z, group, lane, at, rho, wp.cross(centre, up))
