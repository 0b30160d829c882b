"""The water of an instance in place and time: surface, waves, current. Warp functions."""

import warp as wp

from .arrays import Arrays

wp.set_module_options({"enable_backward": False})


@wp.struct
class Surface:
    """The plane that the surface is about a place: unit normal towards the air, and a point of it [m], world."""

    up: wp.vec3
    point: wp.vec3


@wp.struct
class Flow:
    """Velocity [m/s] and acceleration [m/s^2] of the water at a point, world."""

    velocity: wp.vec3
    acceleration: wp.vec3


@wp.func
def phase_of(a: Arrays, wave: int, at: wp.vec3, time: float) -> float:
    """Phase of a wave [rad] at a place and time."""
    k = a.wave_number[wave]
    return k[0] * at[0] + k[1] * at[1] - a.wave_frequency[wave] * time + a.wave_phase[wave]


@wp.func
def surface_about(a: Arrays, water: int, at: wp.vec3, time: float) -> Surface:
    """The surface above or below a place: height and slope of the waves there."""
    elevation = float(0.0)
    slope = wp.vec2(0.0, 0.0)
    for wave in range(a.wave_start[water], a.wave_start[water + 1]):
        phase = phase_of(a, wave, at, time)
        elevation += a.wave_amplitude[wave] * wp.cos(phase)
        slope -= a.wave_amplitude[wave] * wp.sin(phase) * a.wave_number[wave]
    surface = Surface()
    surface.up = wp.normalize(wp.vec3(-slope[0], -slope[1], 1.0))
    surface.point = wp.vec3(at[0], at[1], a.waterline[water] + elevation)
    return surface


@wp.func
def current_at(a: Arrays, world: int, water: int, depth: float) -> wp.vec3:
    """Velocity of the current at a depth below the still level [m/s]; linear between points, constant outside."""
    velocity = a.current[world % a.current.shape[0], water]
    first, last = a.profile_start[water], a.profile_start[water + 1] - 1
    if last < first:
        return velocity
    if depth <= a.profile_depth[first]:
        return velocity + a.profile_velocity[first]
    at = first
    while at < last and a.profile_depth[at + 1] <= depth:
        at += 1
    if at == last:
        return velocity + a.profile_velocity[last]
    share = (depth - a.profile_depth[at]) / (a.profile_depth[at + 1] - a.profile_depth[at])
    return velocity + wp.lerp(a.profile_velocity[at], a.profile_velocity[at + 1], share)


@wp.func
def flow_at(a: Arrays, world: int, water: int, at: wp.vec3, time: float, gust: wp.vec3) -> Flow:
    """Current, gust and waves at a point; waves above the still level are as at it, below the bed as at the bed."""
    flow = Flow()
    height = at[2] - a.waterline[water]
    flow.velocity = gust + current_at(a, world, water, -height)
    z = wp.clamp(height, a.bed[water], 0.0)
    for wave in range(a.wave_start[water], a.wave_start[water + 1]):
        phase = phase_of(a, wave, at, time)
        sin, cos = wp.sin(phase), wp.cos(phase)
        k = a.wave_number[wave]
        down = wp.exp(wp.length(k) * z)
        upward = a.wave_upward[wave] / down
        level = a.wave_pressure[wave] * (down + upward)
        upright = a.wave_pressure[wave] * wp.length(k) * (down - upward)
        inverse = 1.0 / a.wave_frequency[wave]
        flow.velocity += wp.vec3(k[0] * level * cos, k[1] * level * cos, upright * sin) * inverse
        flow.acceleration += wp.vec3(k[0] * level * sin, k[1] * level * sin, -upright * cos)
    return flow
