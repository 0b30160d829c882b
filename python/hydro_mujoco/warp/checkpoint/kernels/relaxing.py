"""The Relaxation-ODE's window, memory and modes: Warp kernels (crates/model/src/engine/relaxation_engine.rs)."""

import warp as wp

from .dense import gate

wp.set_module_options({"enable_backward": False})

#: Offset of the slowest number of a memory, and of each mode from the one before.
SLOWEST = wp.constant(7.0)
MODE_OFFSET = wp.constant(2.0)


@wp.func
def chosen(new: wp.vec4, old: wp.vec4, where: wp.vec4) -> wp.vec4:
    """The new numbers where `where` is not 0, else the old."""
    for i in range(4):
        if where[i] == 0.0:
            new[i] = old[i]
    return new


@wp.kernel
def push(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    z: wp.array2d[wp.vec4],
    # Memory
    window: wp.array3d[wp.vec4],
):
    """Puts the newest sample into the window, newest first; at a start the whole window is that sample."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    for back in range(1, window.shape[1]):
        lag = window.shape[1] - back
        moved = chosen(window[group, lag - 1, i], window[group, lag, i], due[group, 0])
        window[group, lag, i] = chosen(z[group, i], moved, starts[group, 0])
    window[group, 0, i] = chosen(z[group, i], window[group, 0, i], due[group, 0])


@wp.kernel
def differences(
    due: wp.array2d[wp.vec4],
    window: wp.array3d[wp.vec4],
    # Out
    h: wp.array2d[wp.vec4],
):
    """The newest sample, and the differences of neighbours."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    h[group, i] = window[group, 0, i]
    for lag in range(1, window.shape[1]):
        h[group, lag * window.shape[2] + i] = window[group, lag - 1, i] - window[group, lag, i]


@wp.kernel
def lead(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    led: wp.array2d[wp.vec4],
    # Memory
    remembered: wp.array2d[wp.vec4],
    # Out
    h: wp.array2d[wp.vec4],
):
    """Leads the memory's numbers to their targets, `led` the targets and rates; h: their place behind the window."""
    group, i = wp.tid()
    numbers = remembered.shape[1]
    offset = SLOWEST * float(i) / float(numbers)
    share = gate(led[group, numbers + i] - wp.vec4(offset, offset, offset, offset))
    share = chosen(wp.vec4(1.0, 1.0, 1.0, 1.0), share, starts[group, 0])
    before = chosen(wp.vec4(0.0, 0.0, 0.0, 0.0), remembered[group, i], starts[group, 0])
    after = before + wp.cw_mul(share, led[group, i] - before)
    remembered[group, i] = chosen(after, remembered[group, i], due[group, 0])
    h[group, i] = after


@wp.kernel
def relax(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    found: wp.array2d[wp.vec4],
    mean: wp.array[float],
    std: wp.array[float],
    first: wp.array2d[wp.vec4],
    # Memory
    slower: wp.array3d[wp.vec4],
    # In and out
    now: wp.array2d[wp.vec4],
):
    """The force at a sample from the one before: every mode goes its share of the way to its target.

    found: targets, then rates, by mode and output. first: the force at a start, in place of what the targets add up to.
    slower: the modes after the first. now: [N, N m].
    """
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    outputs, modes = now.shape[1], slower.shape[1] + 1
    one = wp.vec4(1.0, 1.0, 1.0, 1.0)
    a = one - gate(found[group, modes * outputs + i])
    b = wp.cw_mul(one - a, found[group, i])
    for mode in range(1, modes):
        target = found[group, mode * outputs + i]
        offset = MODE_OFFSET * float(mode) * one
        share = gate(found[group, (modes + mode) * outputs + i] - offset)
        before = slower[group, mode - 1, i]
        after = before + wp.cw_mul(share, target - before)
        b += after - wp.cw_mul(a, before)
        slower[group, mode - 1, i] = chosen(target, chosen(after, before, due[group, 0]), starts[group, 0])
    centre = mean[i] * one
    next = centre + wp.cw_mul(a, now[group, i] - centre) + std[i] * b
    next = chosen(first[group, i], next, starts[group, 0])
    now[group, i] = chosen(next, now[group, i], due[group, 0])


@wp.kernel
def settle(
    starts: wp.array2d[wp.vec4],
    found: wp.array2d[wp.vec4],
    modes: int,
    mean: wp.array[float],
    std: wp.array[float],
    # Out
    first: wp.array2d[wp.vec4],
):
    """The force at a start [N, N m]: what the targets of all modes add up to."""
    group, i = wp.tid()
    if wp.length_sq(starts[group, 0]) == 0.0:
        return
    sum = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for mode in range(modes):
        sum += found[group, mode * first.shape[1] + i]
    first[group, i] = wp.vec4(mean[i], mean[i], mean[i], mean[i]) + std[i] * sum
