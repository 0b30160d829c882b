"""Water that remembers the motion of a body: Warp kernel and functions (crates/effects: wake_memory, basset_history).

There is no hook at a step's end: the memory is brought on where the time has gone on, with the motion that the forces
of the step before were made of. Where the time goes back it starts anew.
"""

import warp as wp

from .arrays import Arrays
from .laws import Drag, moved, upper

wp.set_module_options({"enable_backward": False})

#: Exponentials of a history force.
EXPONENTIALS = 8
vec8 = wp.types.vector(length=EXPONENTIALS, dtype=float)
#: Rates [1/s] and weights [s^-1/2] of exponentials whose sum is 1 / sqrt(t).
RATES = wp.constant(
    vec8(
        *(0.01727043196, 0.08258209475, 0.3948831384, 1.888214309),
        *(9.028882042, 43.17344199, 206.4426232, 987.1475309),
    )
)
WEIGHTS = wp.constant(
    vec8(
        *(0.2612055782, 0.1947082506, 0.5699013953, 1.208122931),
        *(2.650293469, 5.826663930, 12.35935997, 51.36771213),
    )
)


@wp.struct
class Wakes:
    """Memory by world and row, of a body's middle in its frame."""

    latest: wp.array2d[float]  # time of the latest forces [s]
    motion: wp.array2d[wp.spatial_vector]  # of the body's origin through the water then
    wake: wp.array2d[wp.spatial_vector]  # filtered velocities [m/s, rad/s]
    is_started: wp.array2d[int]
    velocity: wp.array2d[wp.vec3]  # one step before [m/s]
    filtered: wp.array3d[wp.vec3]  # velocities [m/s], by exponential


def no_wakes(shape: tuple[int, int], device: wp.Device) -> Wakes:
    """Memory of so many worlds and rows: none yet."""
    made = Wakes()
    made.latest = wp.zeros(shape, dtype=float, device=device)
    made.is_started = wp.zeros(shape, dtype=int, device=device)
    for name in ("motion", "wake"):
        setattr(made, name, wp.zeros(shape, dtype=wp.spatial_vector, device=device))
    made.velocity = wp.zeros(shape, dtype=wp.vec3, device=device)
    made.filtered = wp.zeros((*shape, EXPONENTIALS), dtype=wp.vec3, device=device)
    return made


@wp.func
def mean_of(x: float) -> float:
    """(1 - exp(-x)) / x, for small x by its series: the difference loses digits."""
    if x < 0.1:
        return 1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
    return (1.0 - wp.exp(-x)) / x


@wp.func
def left(filtered: wp.vec3, x: float, before: wp.vec3, now: wp.vec3) -> wp.vec3:
    """Velocity minus filtered velocity, after a time in which the velocity goes from `before` to `now` along a line.

    x: rate times that time. Differences alone, so that nothing cancels.
    """
    decay = wp.exp(-x)
    return decay * (now - filtered) + (mean_of(x) - decay) * (now - before)


@wp.kernel
def follow(option_timestep: wp.array[float], time: wp.array[float], a: Arrays, w: Wakes):
    """Brings the memory to the present time: on by a step where the time went on, anew where it went back."""
    world, row = wp.tid()
    step = option_timestep[world % option_timestep.shape[0]]
    passed = time[world] - w.latest[world, row]
    w.latest[world, row] = time[world]
    if passed < -0.5 * step:
        w.wake[world, row] = wp.spatial_vector()
        w.is_started[world, row] = 0
    elif passed > 0.5 * step:
        motion = moved(a.middle[row]) * w.motion[world, row]
        x = wp.max(a.wake_rate[world % a.wake_rate.shape[0], row], 0.0) * step
        arrived = x * mean_of(x)
        w.wake[world, row] += arrived * (motion - w.wake[world, row])
        velocity = upper(motion)
        for i in range(8):
            filtered = velocity
            if w.is_started[world, row] == 1:
                filtered -= left(w.filtered[world, row, i], RATES[i] * step, w.velocity[world, row], velocity)
            w.filtered[world, row, i] = filtered
        w.velocity[world, row] = velocity
        w.is_started[world, row] = 1


@wp.func
def remembered(a: Arrays, w: Wakes, world: int, row: int, motion: wp.spatial_vector, step: float, drag: Drag) -> Drag:
    """The drag, about the origin, with those of the memories; motion: of the origin through the water, now."""
    at_middle = moved(a.middle[row])
    amplitude = a.wake[world % a.wake.shape[0], row]
    load = -wp.cw_mul(amplitude, w.wake[world, row])
    history = a.basset[world % a.basset.shape[0], row]
    if w.is_started[world, row] == 1 and wp.length_sq(history) > 0.0:
        now = upper(at_middle * motion)
        past = wp.vec3(0.0, 0.0, 0.0)
        slope = float(0.0)
        for i in range(8):
            x = RATES[i] * step
            past += WEIGHTS[i] * left(w.filtered[world, row, i], x, w.velocity[world, row], now)
            slope += WEIGHTS[i] * mean_of(x)
        load -= wp.spatial_vector(wp.cw_mul(history, past), wp.vec3(0.0, 0.0, 0.0))
        damping = wp.spatial_matrix()
        for axis in range(3):
            damping[axis, axis] = slope * history[axis]
        drag.damping += wp.transpose(at_middle) * damping * at_middle
    drag.load += wp.transpose(at_middle) * load
    return drag
