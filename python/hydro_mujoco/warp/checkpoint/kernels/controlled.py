"""The CNODE's step along the path of the samples: Warp kernels (crates/model/src/engine/cnode_engine.rs)."""

import warp as wp

from .relaxing import chosen
from .stepping import all_of, within

wp.set_module_options({"enable_backward": False})

#: Bound of the state [standard deviations].
STATE_LIMIT = wp.constant(100.0)


@wp.kernel
def begin_path(
    starts: wp.array2d[wp.vec4],
    first: wp.array2d[wp.vec4],
    mean: wp.array[float],
    std: wp.array[float],
    least: wp.array[float],
    most: wp.array[float],
    z: wp.array2d[wp.vec4],
    # Out
    seen: wp.array2d[wp.vec4],
):
    """What the first state is made of: the first force, standardised, then the sample."""
    group, i = wp.tid()
    if wp.length_sq(starts[group, 0]) == 0.0:
        return
    outputs = first.shape[1]
    if i < outputs:
        seen[group, i] = (within(first[group, i], least[i], most[i]) - all_of(mean[i])) / std[i]
    else:
        seen[group, i] = z[group, i - outputs]


@wp.kernel
def stage_of_path(
    due: wp.array2d[wp.vec4],
    state: wp.array2d[wp.vec4],
    along: float,
    is_first: bool,
    # In and out
    slope: wp.array2d[wp.vec4],
    change: wp.array2d[wp.vec4],
    # Out
    input: wp.array2d[wp.vec4],
):
    """The state at which a stage asks the field."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    if is_first:
        slope[group, i] = all_of(0.0)
        change[group, i] = all_of(0.0)
    input[group, i] = state[group, i] + along * slope[group, i]


@wp.kernel
def follow_path(
    due: wp.array2d[wp.vec4],
    found: wp.array2d[wp.vec4],
    older: wp.array2d[wp.vec4],
    newer: wp.array2d[wp.vec4],
    z: wp.array2d[wp.vec4],
    is_euler: bool,
    along: float,
    weight: float,
    # In and out
    slope: wp.array2d[wp.vec4],
    change: wp.array2d[wp.vec4],
):
    """The slope of the state in a stage: the field's matrix times that of the path, time its last channel."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    n = z.shape[1]
    row = i * (n + 1)
    sum = found[group, row + n]
    for j in range(n):
        path = z[group, j] - newer[group, j]
        if not is_euler:
            before = newer[group, j] - older[group, j]
            path = before + (path - before) * ((4.0 - 3.0 * along) * along)
        sum += wp.cw_mul(found[group, row + j], path)
    slope[group, i] = sum
    change[group, i] += weight * sum


@wp.kernel
def end_path(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    seen: wp.array2d[wp.vec4],
    lifted: wp.array2d[wp.vec4],
    change: wp.array2d[wp.vec4],
    outputs: int,
    # Memory
    state: wp.array2d[wp.vec4],
):
    """The state at the sample; at a start, the first force and what is lifted from it."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    stepped = within(state[group, i] + change[group, i], -STATE_LIMIT, STATE_LIMIT)
    first = seen[group, 0]
    if i < outputs:
        first = seen[group, i]
    else:
        first = lifted[group, i - outputs]
    state[group, i] = chosen(first, chosen(stepped, state[group, i], due[group, 0]), starts[group, 0])


@wp.kernel
def remember_path(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    z: wp.array2d[wp.vec4],
    # Memory
    older: wp.array2d[wp.vec4],
    newer: wp.array2d[wp.vec4],
):
    """Keeps the two latest samples."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    before = chosen(z[group, i], newer[group, i], starts[group, 0])
    older[group, i] = chosen(before, older[group, i], due[group, 0])
    newer[group, i] = chosen(z[group, i], newer[group, i], due[group, 0])
