"""Parts of closed shapes below the water's surface, a plane: Warp functions.

A part is (volume [m^3], first moment x y z [m^4]). A plane is its unit normal `up`, towards the air, and its `level`: a
point x is wet where up . x <= level.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def ellipsoid_below(semi_axes: wp.vec3, up: wp.vec3, level: float) -> wp.vec4:
    """Closed form about the ellipsoid's centre, in the frame of its axes: the map to the unit ball keeps planes."""
    normal = wp.cw_mul(semi_axes, up)
    reach = wp.length(normal)
    if reach == 0.0:
        return wp.vec4(0.0, 0.0, 0.0, 0.0)
    t = wp.clamp(level / reach, -1.0, 1.0)
    below = 1.0 + t
    squared = below * (1.0 - t)
    scale = semi_axes[0] * semi_axes[1] * semi_axes[2]
    volume = scale * wp.pi / 3.0 * below * below * (2.0 - t)
    along = -scale * wp.pi / 4.0 * squared * squared
    moment = wp.cw_mul(semi_axes, normal) * (along / reach)
    return wp.vec4(volume, moment[0], moment[1], moment[2])


@wp.func
def tetrahedron(apex: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec4:
    """Signed volume of a tetrahedron, positive where a, b, c turn left seen from outside, and its moment."""
    volume = wp.dot(a - apex, wp.cross(b - apex, c - apex)) / 6.0
    moment = (apex + a + b + c) * (0.25 * volume)
    return wp.vec4(volume, moment[0], moment[1], moment[2])


@wp.func
def crossing(a: wp.vec3, b: wp.vec3, over_a: float, over_b: float) -> wp.vec3:
    """Where the edge from a, wet, to b, dry, leaves the water; over: height of each above the plane."""
    return a + (b - a) * (over_a / (over_a - over_b))


@wp.func
def triangle_below(apex: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, up: wp.vec3, level: float) -> wp.vec4:
    """What the wet part of a triangle of a closed surface adds: tetrahedra between it and an apex on the plane."""
    over_a, over_b, over_c = wp.dot(up, a) - level, wp.dot(up, b) - level, wp.dot(up, c) - level
    if over_a <= 0.0 and over_b <= 0.0 and over_c <= 0.0:
        return tetrahedron(apex, a, b, c)
    if over_a > 0.0 and over_b > 0.0 and over_c > 0.0:
        return wp.vec4(0.0, 0.0, 0.0, 0.0)
    # Turned so that the first corner is alone on its side.
    first, second, third = a, b, c
    one, two, three = over_a, over_b, over_c
    if (over_b > 0.0) != (over_a > 0.0) and (over_b > 0.0) != (over_c > 0.0):
        first, second, third = b, c, a
        one, two, three = over_b, over_c, over_a
    elif (over_c > 0.0) != (over_a > 0.0) and (over_c > 0.0) != (over_b > 0.0):
        first, second, third = c, a, b
        one, two, three = over_c, over_a, over_b
    to_second = crossing(first, second, one, two)
    to_third = crossing(first, third, one, three)
    if one <= 0.0:
        return tetrahedron(apex, first, to_second, to_third)
    return tetrahedron(apex, to_second, second, third) + tetrahedron(apex, to_second, third, to_third)
