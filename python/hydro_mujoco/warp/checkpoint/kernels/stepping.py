"""Steps of a force that follows a differential equation: Warp kernels (crates/model/src/engine/ode_engine.rs)."""

import warp as wp

from ..lanes import LANES
from .relaxing import chosen

wp.set_module_options({"enable_backward": False})

#: Change of a force in one step [standard deviations] below which it has settled, and most steps to get there.
SETTLED = wp.constant(1.0e-6)
SETTLING_STEPS = wp.constant(200)


@wp.func
def all_of(value: float) -> wp.vec4:
    """The same number for four worlds."""
    return wp.vec4(value, value, value, value)


@wp.func
def within(x: wp.vec4, least: float, most: float) -> wp.vec4:
    """The numbers, none outside a range."""
    for i in range(4):
        x[i] = wp.clamp(x[i], least, most)
    return x


@wp.kernel
def begin(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    first: wp.array2d[wp.vec4],
    mean: wp.array[float],
    std: wp.array[float],
    least: wp.array[float],
    most: wp.array[float],
    next: wp.array2d[wp.vec4],
    # Out
    now: wp.array2d[wp.vec4],
    force: wp.array2d[wp.vec4],
    slope: wp.array2d[wp.vec4],
    change: wp.array2d[wp.vec4],
):
    """The force at a sample is that foretold at the one before; now: [N, N m]; force: standardised."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    held = within(chosen(first[group, i], next[group, i], starts[group, 0]), least[i], most[i])
    now[group, i] = chosen(held, now[group, i], due[group, 0])
    force[group, i] = (held - all_of(mean[i])) / std[i]
    slope[group, i] = all_of(0.0)
    change[group, i] = all_of(0.0)


@wp.kernel
def stage(
    due: wp.array2d[wp.vec4],
    force: wp.array2d[wp.vec4],
    slope: wp.array2d[wp.vec4],
    along: float,
    # Out
    input: wp.array2d[wp.vec4],
):
    """The force at which a stage asks the field."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) > 0.0:
        input[group, i] = force[group, i] + along * slope[group, i]


@wp.kernel
def accumulate(due: wp.array2d[wp.vec4], slope: wp.array2d[wp.vec4], weight: float, change: wp.array2d[wp.vec4]):
    """Adds the slope of a stage to the change of the step."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) > 0.0:
        change[group, i] += weight * slope[group, i]


@wp.kernel
def finish(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    force: wp.array2d[wp.vec4],
    change: wp.array2d[wp.vec4],
    mean: wp.array[float],
    std: wp.array[float],
    at_end: bool,
    # In and out
    now: wp.array2d[wp.vec4],
    next: wp.array2d[wp.vec4],
):
    """The force one step later [N, N m]; at_end: it is that of the sample itself, which drove the step."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    stepped = all_of(mean[i]) + std[i] * (force[group, i] + change[group, i])
    if at_end:
        stepped = chosen(now[group, i], stepped, starts[group, 0])
        now[group, i] = chosen(stepped, now[group, i], due[group, 0])
    next[group, i] = chosen(stepped, next[group, i], due[group, 0])


@wp.kernel
def begin_to_settle(
    starts: wp.array3d[float],
    # Out
    force: wp.array3d[float],
    slope: wp.array3d[float],
    change: wp.array3d[float],
    settling: wp.array3d[float],
    steps: wp.array[int],
    is_any: wp.array[int],
):
    """A first force is looked for from the mean of the training on, in the worlds that start."""
    world = wp.tid()
    group, lane = world // LANES, world % LANES
    settling[group, 0, lane] = starts[group, 0, lane]
    if starts[group, 0, lane] == 0.0:
        return
    is_any[0] = 1
    steps[world] = 0
    for i in range(force.shape[1]):
        force[group, i, lane] = 0.0
        slope[group, i, lane] = 0.0
        change[group, i, lane] = 0.0


@wp.kernel
def clear(is_any: wp.array[int]):
    """No world settles."""
    is_any[0] = 0


@wp.kernel
def settle_on(
    # In and out
    force: wp.array3d[float],
    slope: wp.array3d[float],
    change: wp.array3d[float],
    settling: wp.array3d[float],
    steps: wp.array[int],
    # Out
    is_any: wp.array[int],
):
    """Takes a step of the worlds that settle; one whose force no longer changes is done."""
    world = wp.tid()
    group, lane = world // LANES, world % LANES
    if settling[group, 0, lane] == 0.0:
        return
    greatest = float(0.0)
    for i in range(force.shape[1]):
        moved = change[group, i, lane]
        # No number never settles.
        if wp.isfinite(moved):
            greatest = wp.max(greatest, wp.abs(moved))
        else:
            greatest = 1.0
        force[group, i, lane] += moved
        slope[group, i, lane] = 0.0
        change[group, i, lane] = 0.0
    steps[world] += 1
    if greatest < SETTLED or steps[world] >= SETTLING_STEPS:
        settling[group, 0, lane] = 0.0
    else:
        is_any[0] = 1


@wp.kernel
def to_si(
    due: wp.array2d[wp.vec4],
    found: wp.array2d[wp.vec4],
    mean: wp.array[float],
    std: wp.array[float],
    # Out
    force: wp.array2d[wp.vec4],
):
    """Forces [N, N m] of standardised ones."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) > 0.0:
        force[group, i] = chosen(all_of(mean[i]) + std[i] * found[group, i], force[group, i], due[group, 0])
