"""Gusts, the random part of a current: a Gauss-Markov process in each world (crates/effects/src/sea/current.rs).

The same seed gives the plugin's: its random numbers, in double precision, and its exact step, one a step of the model.
"""

import warp as wp

from .arrays import Arrays

wp.set_module_options({"enable_backward": False})

#: Stream of random numbers of a current.
STREAM = wp.constant(wp.uint64(2))
#: Philox-4x64 with ten rounds: J. K. Salmon et al., SC 2011.
FIRST_MULTIPLIER = wp.constant(wp.uint64(0xD2E7470EE14C6C93))
SECOND_MULTIPLIER = wp.constant(wp.uint64(0xCA5A826395121157))
FIRST_WEYL = wp.constant(wp.uint64(0x9E3779B97F4A7C15))
SECOND_WEYL = wp.constant(wp.uint64(0xBB67AE8584CAA73B))
HALF = wp.constant(wp.uint64(32))
LOW = wp.constant(wp.uint64(0xFFFFFFFF))


@wp.func
def high_product(a: wp.uint64, b: wp.uint64) -> wp.uint64:
    """The upper 64 bits of a product."""
    a_high, a_low = a >> HALF, a & LOW
    b_high, b_low = b >> HALF, b & LOW
    middle = a_high * b_low + ((a_low * b_low) >> HALF)
    other = a_low * b_high + (middle & LOW)
    return a_high * b_high + (middle >> HALF) + (other >> HALF)


@wp.func
def uniform(word: wp.uint64) -> wp.float64:
    """A number between 0 and 1, never either."""
    return (wp.float64(word >> wp.uint64(12)) + wp.float64(0.5)) * wp.float64(2.220446049250313e-16)


@wp.func
def normals(seed: wp.uint64, counter: wp.uint64) -> wp.vec3d:
    """Three independent numbers of the standard normal distribution."""
    key, other_key = seed, STREAM
    a, b, c, d = counter, wp.uint64(0), wp.uint64(0), wp.uint64(0)
    for _ in range(10):
        high_a, low_a = high_product(FIRST_MULTIPLIER, a), FIRST_MULTIPLIER * a
        high_c, low_c = high_product(SECOND_MULTIPLIER, c), SECOND_MULTIPLIER * c
        a, b, c, d = high_c ^ b ^ key, low_c, high_a ^ d ^ other_key, low_a
        key += FIRST_WEYL
        other_key += SECOND_WEYL
    turn = wp.float64(6.283185307179586)
    radius = wp.sqrt(wp.float64(-2.0) * wp.log(uniform(a)))
    other_radius = wp.sqrt(wp.float64(-2.0) * wp.log(uniform(c)))
    angle, other_angle = turn * uniform(b), turn * uniform(d)
    return wp.vec3d(radius * wp.cos(angle), radius * wp.sin(angle), other_radius * wp.cos(other_angle))


@wp.func
def drawn(deviation: wp.vec3, seed: wp.uint64, counter: int) -> wp.vec3:
    """Numbers of the process's deviations."""
    normal = normals(seed, wp.uint64(counter))
    return wp.cw_mul(deviation, wp.vec3(float(normal[0]), float(normal[1]), float(normal[2])))


@wp.kernel
def blow(
    option_timestep: wp.array[float],
    time: wp.array[float],
    a: Arrays,
    # Memory
    latest: wp.array2d[float],
    draws: wp.array2d[int],
    gust: wp.array2d[wp.vec3],
):
    """Brings each gust [m/s] to the present time: on by a step where the time went on, anew where it went back."""
    world, water = wp.tid()
    now = time[world]
    step = option_timestep[world % option_timestep.shape[0]]
    deviation = a.gust_deviation[world % a.gust_deviation.shape[0], water]
    seed = a.gust_seed[world % a.gust_seed.shape[0], water]
    passed = now - latest[world, water]
    if draws[world, water] == 0 or passed < -0.5 * step:
        gust[world, water] = drawn(deviation, seed, 0)
        draws[world, water] = 1
    elif passed > 0.5 * step:
        steps = step / a.gust_time[water]
        noise = drawn(deviation, seed, draws[world, water])
        add = wp.sqrt(1.0 - wp.exp(-2.0 * steps))
        gust[world, water] = wp.exp(-steps) * gust[world, water] + add * noise
        draws[world, water] += 1
    latest[world, water] = now
