"""Parts of closed shapes below the water's surface, a plane: Warp functions.

A part is (volume [m^3], first moment x y z [m^4]). A plane is its unit normal `up`, towards the air, and its `level`: a
point x is wet where up . x <= level. Shapes and planes stand in the shape's own frame.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

vec8 = wp.types.vector(length=8, dtype=float)


#: Gauss-Legendre abscissae and weights on 0 to 1, eight points.
NODES = wp.constant(
    vec8(
        *(0.019855071751231884, 0.10166676129318663, 0.2372337950418355, 0.4082826787521751),
        *(0.591717321247825, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681),
    )
)
WEIGHTS = wp.constant(
    vec8(
        *(0.05061426814518813, 0.11119051722668724, 0.15685332293894364, 0.181341891689181),
        *(0.181341891689181, 0.15685332293894364, 0.11119051722668724, 0.05061426814518813),
    )
)


@wp.func
def part(volume: float, moment: wp.vec3) -> wp.vec4:
    """A part as four numbers."""
    return wp.vec4(volume, moment[0], moment[1], moment[2])


@wp.func
def shifted(own: wp.vec4, axes: wp.mat33, place: wp.vec3) -> wp.vec4:
    """A part in another frame: its axes there as columns, its origin there."""
    return part(own[0], axes * wp.vec3(own[1], own[2], own[3]) + own[0] * place)


@wp.func
def unit_cap(t: float) -> wp.vec2:
    """Volume and moment along up of the part of the unit ball with up . x <= t, t within -1 and 1."""
    below = 1.0 + t
    squared = below * (1.0 - t)
    return wp.vec2(wp.pi / 3.0 * below * below * (2.0 - t), -wp.pi / 4.0 * squared * squared)


@wp.func
def ellipsoid_below(semi_axes: wp.vec3, up: wp.vec3, level: float) -> wp.vec4:
    """An ellipsoid along the axes: the map to the unit ball keeps planes."""
    normal = wp.cw_mul(semi_axes, up)
    reach = wp.length(normal)
    if reach == 0.0:
        return wp.vec4(0.0, 0.0, 0.0, 0.0)
    cap = unit_cap(wp.clamp(level / reach, -1.0, 1.0))
    scale = semi_axes[0] * semi_axes[1] * semi_axes[2]
    return part(scale * cap[0], wp.cw_mul(semi_axes, normal) * (scale * cap[1] / reach))


@wp.func
def cylinder_below(radius: float, half_length: float, up: wp.vec3, level: float) -> wp.vec4:
    """A cylinder about z.

    Slices below `bottom` are wet whole, those above `top` dry; between them the chord that cuts a slice is minus the
    cosine [radii] of an angle in which the slice's area and moment are smooth.
    """
    h = half_length
    along = wp.abs(up[2])
    across = wp.sqrt(up[0] * up[0] + up[1] * up[1])
    rim = across * radius
    bottom = wp.where(level >= rim, h, -h)
    top = wp.where(level > -rim, h, -h)
    if along > 1.0e-6:
        bottom = wp.clamp((level - rim) / along, -h, h)
        top = wp.clamp((level + rim) / along, -h, h)
    volume = wp.pi * radius * radius * (bottom + h)
    axial = 0.5 * volume * (bottom - h)
    lateral = float(0.0)
    if top > bottom:
        wettest = wp.acos(wp.clamp((along * bottom - level) / rim, -1.0, 1.0))
        driest = wp.acos(wp.clamp((along * top - level) / rim, -1.0, 1.0))
        span = wettest - driest
        half_sine = wp.max(wp.sin(0.5 * span), 1.0e-12)
        mean_sine = wp.max(wp.sin(0.5 * (wettest + driest)), 1.0e-12)
        slope = wp.where(span < 1.0e-3, 1.0, 0.5 * span / half_sine) / mean_sine
        for i in range(8):
            angle = driest + NODES[i] * span
            share = wp.where(span < 1.0e-3, NODES[i], wp.sin(0.5 * NODES[i] * span) / half_sine)
            z = top + (bottom - top) * share * wp.sin(0.5 * (angle + driest)) / mean_sine
            sine = wp.sin(angle)
            weight = WEIGHTS[i] * (top - bottom) * slope * sine * radius * radius
            area = angle - sine * wp.cos(angle)
            volume += weight * area
            axial += weight * z * area
            lateral -= weight * radius * 2.0 / 3.0 * sine * sine * sine
        lateral /= across
    return part(volume, wp.vec3(up[0] * lateral, up[1] * lateral, wp.where(up[2] < 0.0, -axial, axial)))


@wp.func
def unit_half_ball_below(up: wp.vec3, t: float) -> wp.vec4:
    """The half z >= 0 of the unit ball below the plane at t."""
    whole = part(2.0 / 3.0 * wp.pi, wp.vec3(0.0, 0.0, wp.pi / 4.0))
    if t >= 1.0:
        return whole
    if t <= -1.0:
        return wp.vec4(0.0, 0.0, 0.0, 0.0)
    along = up[2]
    across = wp.sqrt(up[0] * up[0] + up[1] * up[1])
    if wp.abs(t) >= across:
        # The plane misses the flat disc: the wet part is nothing, a cap, all but a cap, or all.
        if along > 0.0 and t > 0.0:
            cap = unit_cap(-t)
            return whole - part(cap[0], -up * cap[1])
        if along > 0.0:
            return wp.vec4(0.0, 0.0, 0.0, 0.0)
        if t > 0.0:
            return whole
        cap = unit_cap(t)
        return part(cap[0], up * cap[1])
    # Bounded by a patch of the sphere, a segment of the plane's disc and one of the flat disc, which share a chord:
    # by the divergence theorem the volume is the integral of x . n / 3 over them, the moment that of x . x n / 2.
    root = wp.sqrt((across - t) * (across + t))
    half_chord = root / across
    plane_angle = wp.atan2(root, -t * along)
    flat_angle = wp.atan2(root, -t)
    patch = 2.0 * (wp.atan2(root, along) + t * plane_angle)
    plane_chord = t * along / across
    flat_chord = t / across
    plane_square = (1.0 - t) * (1.0 + t)
    plane = plane_square * plane_angle + plane_chord * half_chord
    flat = flat_angle + flat_chord * half_chord
    sixth = half_chord * half_chord / 6.0
    plane_polar = 0.5 * plane_square * plane_square * plane_angle
    plane_polar += plane_chord * half_chord * (0.5 * plane_chord * plane_chord + sixth)
    flat_polar = 0.5 * flat_angle + flat_chord * half_chord * (0.5 * flat_chord * flat_chord + sixth)
    on_plane = 0.5 * (plane_polar - plane_square * plane)
    on_flat = 0.5 * (flat - flat_polar)
    return part(wp.max((patch + t * plane) / 3.0, 0.0), up * on_plane + wp.vec3(0.0, 0.0, on_flat))


@wp.func
def capsule_below(radius: float, half_length: float, up: wp.vec3, level: float) -> wp.vec4:
    """A capsule about z: a cylinder and two half balls, the lower one an upper one in a mirror."""
    lift = up[2] * half_length
    cube = radius * radius * radius
    ball = unit_half_ball_below(up, (level - lift) / radius)
    upper = part(cube * ball[0], cube * radius * wp.vec3(ball[1], ball[2], ball[3]))
    upper[3] += half_length * upper[0]
    ball = unit_half_ball_below(wp.vec3(up[0], up[1], -up[2]), (level + lift) / radius)
    lower = part(cube * ball[0], cube * radius * wp.vec3(ball[1], ball[2], -ball[3]))
    lower[3] -= half_length * lower[0]
    return cylinder_below(radius, half_length, up, level) + upper + lower


@wp.func
def tetrahedron(apex: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec4:
    """Signed volume of a tetrahedron, positive where a, b, c turn left seen from outside, and its moment."""
    volume = wp.dot(a - apex, wp.cross(b - apex, c - apex)) / 6.0
    return part(volume, (apex + a + b + c) * (0.25 * volume))


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
