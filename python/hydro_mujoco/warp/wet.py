"""How much of hulls is under water: Warp functions, and a kernel for a whole robot."""

import warp as wp

from .arrays import Arrays
from .sea import surface_about
from .solids import CAPSULE, CYLINDER, ELLIPSOID, TRIANGLES
from .surface import capsule_below, cylinder_below, ellipsoid_below, shifted, triangle_below

wp.set_module_options({"enable_backward": False})


@wp.func
def solid_below(a: Arrays, solid: int, up: wp.vec3, level: float) -> wp.vec4:
    """The part of a solid below a plane; both in the body's frame."""
    sum = wp.vec4(0.0, 0.0, 0.0, 0.0)
    place, axes = a.solid_centre[solid], a.solid_axes[solid]
    size, kind = a.solid_size[solid], a.solid_kind[solid]
    over = level - wp.dot(up, place)
    if kind == TRIANGLES:
        for at in range(a.triangle_start[solid], a.triangle_start[solid + 1]):
            first, second, third = a.corners[3 * at], a.corners[3 * at + 1], a.corners[3 * at + 2]
            sum += triangle_below(place + over * up, first, second, third, up, level)
    elif kind == ELLIPSOID:
        sum += shifted(ellipsoid_below(size, wp.transpose(axes) * up, over), axes, place)
    elif kind == CYLINDER:
        sum += shifted(cylinder_below(size[0], size[1], wp.transpose(axes) * up, over), axes, place)
    elif kind == CAPSULE:
        sum += shifted(capsule_below(size[0], size[1], wp.transpose(axes) * up, over), axes, place)
    return sum


@wp.func
def wet_part(a: Arrays, row: int, up: wp.vec3, level: float) -> wp.vec4:
    """Share of a hull's volume that is under water, and its centre [m, body frame]."""
    centre = a.centre[row]
    if not a.has_surface[a.water[row]]:
        return wp.vec4(1.0, centre[0], centre[1], centre[2])
    sum = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for solid in range(a.solid_start[row], a.solid_start[row + 1]):
        sum += solid_below(a, solid, up, level)
    if sum[0] <= 0.0:
        return wp.vec4(0.0, centre[0], centre[1], centre[2])
    if not a.centre_is_given[row]:
        centre = wp.vec3(sum[1], sum[2], sum[3]) / sum[0]
    return wp.vec4(wp.min(sum[0] / a.hull_volume[row], 1.0), centre[0], centre[1], centre[2])


@wp.kernel
def wet_robots(
    time: wp.array[float],
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    a: Arrays,
    # Out
    share: wp.array2d[float],
):
    """Share of the volume of each instance's robot that is under water: its checkpoint's force fades with it."""
    world, water = wp.tid()
    wet = float(0.0)
    whole = float(0.0)
    for part in range(a.robot_start[water], a.robot_start[water + 1]):
        body = a.robot_body[part]
        origin, to_world = xpos[world, body], xmat[world, body]
        surface = surface_about(a, water, origin + to_world * a.robot_centre[part], time[world])
        up, level = wp.transpose(to_world) * surface.up, wp.dot(surface.up, surface.point - origin)
        for solid in range(a.robot_solid_start[part], a.robot_solid_start[part + 1]):
            below = solid_below(a, solid, up, level)
            wet += wp.max(below[0], 0.0)
        whole += a.robot_volume[part]
    share[world, water] = wp.where(whole > 0.0, wp.min(wet / wp.max(whole, 1.0e-30), 1.0), 1.0)
