"""Laws of the effects on a body (crates/effects/src/catalogue), with their damping: Warp functions.

A motion is (linear [m/s], angular [rad/s]) of a point through the water, a load (force [N], torque [N m]) about it,
both in the body's frame. A damping is minus the derivative of the load by the motion, 6 x 6.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

#: Of a matrix scaled to ones on its diagonal, in single precision.
ROUNDING = wp.constant(2.0e-6)


@wp.func
def upper(six: wp.spatial_vector) -> wp.vec3:
    """The first three numbers."""
    return wp.vec3(six[0], six[1], six[2])


@wp.func
def lower(six: wp.spatial_vector) -> wp.vec3:
    """The last three numbers."""
    return wp.vec3(six[3], six[4], six[5])


@wp.func
def moved(point: wp.vec3) -> wp.spatial_matrix:
    """Motion of a point [m] by that of the origin: v + omega x r. Transposed: a load at the point, about the origin."""
    matrix = wp.identity(n=6, dtype=float)
    matrix[0, 4] = point[2]
    matrix[0, 5] = -point[1]
    matrix[1, 3] = -point[2]
    matrix[1, 5] = point[0]
    matrix[2, 3] = point[1]
    matrix[2, 4] = -point[0]
    return matrix


@wp.func
def added_mass_load(mass: wp.spatial_matrix, motion: wp.spatial_vector, swell: wp.vec3) -> wp.spatial_vector:
    """Kirchhoff's equations at the origin, without the part in proportion to the origin's acceleration.

    swell: acceleration of the water [m/s^2], body frame.
    """
    v, omega = upper(motion), lower(motion)
    momentum = mass * motion
    p, h = upper(momentum), lower(momentum)
    carried = mass * wp.spatial_vector(swell + wp.cross(omega, v), wp.vec3(0.0, 0.0, 0.0))
    return carried + wp.spatial_vector(wp.cross(p, omega), wp.cross(h, omega) + wp.cross(p, v))


@wp.func
def munk_load(k: wp.vec2, motion: wp.spatial_vector) -> wp.spatial_vector:
    """Munk's moment at the middle; k: for pitch and yaw [kg]."""
    u, v, w = motion[0], motion[1], motion[2]
    return wp.spatial_vector(0.0, 0.0, 0.0, (k[1] - k[0]) * v * w, k[0] * u * w, -k[1] * u * v)


@wp.func
def squares(motion: wp.spatial_vector) -> wp.spatial_vector:
    """|x| x of each number."""
    for i in range(6):
        motion[i] = wp.abs(motion[i]) * motion[i]
    return motion


@wp.func
def slope_of_squares(matrix: wp.spatial_matrix, motion: wp.spatial_vector) -> wp.spatial_matrix:
    """Derivative of a matrix times the squares of a motion."""
    for row in range(6):
        for column in range(6):
            matrix[row, column] *= 2.0 * wp.abs(motion[column])
    return matrix


@wp.func
def lift_load(c: wp.vec2, motion: wp.spatial_vector) -> wp.spatial_vector:
    """Lift at the middle; c: half density times area times slope [kg/m]."""
    speed = wp.abs(motion[0])
    return wp.spatial_vector(0.0, -c[0] * speed * motion[1], -c[1] * speed * motion[2], 0.0, 0.0, 0.0)


@wp.func
def add_lift_damping(c: wp.vec2, motion: wp.spatial_vector, damping: wp.spatial_matrix) -> wp.spatial_matrix:
    """The damping with that of lift."""
    forward = wp.where(motion[0] < 0.0, -1.0, 1.0)
    damping[1, 0] += c[0] * forward * motion[1]
    damping[1, 1] += c[0] * wp.abs(motion[0])
    damping[2, 0] += c[1] * forward * motion[2]
    damping[2, 2] += c[1] * wp.abs(motion[0])
    return damping


@wp.struct
class Strips:
    """Integrals over x from -length/2 to length/2 of powers of x times |s| s, and of x^n |s|, s = speed + x turning."""

    load: float
    moment: float
    damping: wp.vec3


@wp.func
def strips(speed: float, turning: float, length: float) -> Strips:
    """Strips of cross-flow drag in closed form; damping: the integrals of |s|, x |s| and x^2 |s|."""
    half = 0.5 * length
    first, last = speed - turning * half, speed + turning * half
    sums = Strips()
    if first * last >= 0.0:
        cubed = length * length * length
        sign = wp.where(speed < 0.0, -1.0, 1.0)
        sums.load = sign * (speed * speed * length + turning * turning * cubed / 12.0)
        sums.moment = sign * speed * turning * cubed / 6.0
        sums.damping = sign * wp.vec3(speed * length, turning * cubed / 12.0, speed * cubed / 12.0)
        return sums
    # s changes sign inside: antiderivatives over s, counted in its greatest size so that nothing underflows.
    size = wp.max(wp.abs(first), wp.abs(last))
    lo, hi, middle = first / size, last / size, speed / size
    square = (hi * wp.abs(hi) - lo * wp.abs(lo)) / 2.0
    cube = (hi * hi * wp.abs(hi) - lo * lo * wp.abs(lo)) / 3.0
    fourth = (hi * hi * hi * wp.abs(hi) - lo * lo * lo * wp.abs(lo)) / 4.0
    step = length / (hi - lo)
    sums.load = size * size * step * cube
    sums.moment = size * size * step * step * (fourth - middle * cube)
    sums.damping = wp.vec3(
        size * step * square,
        size * step * step * (cube - middle * square),
        size * step * step * step * (fourth - 2.0 * middle * cube + middle * middle * square),
    )
    return sums


@wp.struct
class Drag:
    """A load and its damping."""

    load: wp.spatial_vector
    damping: wp.spatial_matrix


@wp.func
def add_cross_flow(drag: Drag, c: float, axis: int, other: int, lever: float, along: wp.vec2, length: float) -> Drag:
    """The drag with that of strips in the flow along one axis.

    c: half density times coefficient times breadth [kg/m^2]. axis: of the flow. other: the third axis; turning about it
    moves a strip at x along the flow's axis by `lever` x, 1 or -1. along: speed along the axis [m/s], rate about the
    other [rad/s].
    """
    sums = strips(along[0], lever * along[1], length)
    drag.load[axis] -= c * sums.load
    drag.load[3 + other] -= c * lever * sums.moment
    drag.damping[axis, axis] += 2.0 * c * sums.damping[0]
    drag.damping[axis, 3 + other] += 2.0 * c * lever * sums.damping[1]
    drag.damping[3 + other, axis] += 2.0 * c * lever * sums.damping[1]
    drag.damping[3 + other, 3 + other] += 2.0 * c * sums.damping[2]
    return drag


@wp.func
def is_semidefinite(matrix: wp.spatial_matrix) -> bool:
    """True where a symmetric matrix has no eigenvalue below zero but rounding: Cholesky, its diagonal scaled to 1."""
    n = int(6)
    scaled = matrix
    for i in range(n):
        for j in range(n):
            scaled[i, j] = matrix[i, j] / wp.sqrt(wp.max(wp.abs(matrix[i, i] * matrix[j, j]), 1.0e-30))
    for k in range(n):
        pivot = scaled[k, k]
        if pivot < -ROUNDING:
            return False
        for i in range(k + 1, n):
            if pivot > ROUNDING:
                for j in range(k + 1, i + 1):
                    scaled[i, j] -= scaled[i, k] * scaled[j, k] / pivot
            elif wp.abs(scaled[i, k]) > wp.sqrt(ROUNDING):
                return False
    return True


@wp.func
def resisting(damping: wp.spatial_matrix, may_push: bool) -> wp.spatial_matrix:
    """The part of a damping that resists: the symmetric one where it takes energy, else what each axis does alone."""
    symmetric = 0.5 * (damping + wp.transpose(damping))
    if may_push:
        if not is_semidefinite(symmetric):
            diagonal = wp.spatial_matrix()
            for i in range(6):
                diagonal[i, i] = wp.max(symmetric[i, i], 0.0)
            return diagonal
    return symmetric
