"""Products of a network, four worlds at a time: Warp kernels."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def gate(x: wp.vec4) -> wp.vec4:
    """1 / (1 + exp(-x))."""
    for i in range(4):
        x[i] = 1.0 / (1.0 + wp.exp(-x[i]))
    return x


@wp.kernel
def affine(
    due: wp.array2d[wp.vec4],
    weight: wp.array2d[float],
    bias: wp.array[float],
    x: wp.array2d[wp.vec4],
    linear: wp.array2d[float],
    first: wp.array2d[wp.vec4],
    is_activated: bool,
    # Out
    y: wp.array2d[wp.vec4],
):
    """y = W x + b + A x_0 by group and two rows, with SiLU or not; nothing where no world of a group is due.

    Two rows at once read x half as often.
    """
    group, pair = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    row = 2 * pair
    other = wp.min(row + 1, weight.shape[0] - 1)
    sum = wp.vec4(bias[row], bias[row], bias[row], bias[row])
    beside = wp.vec4(bias[other], bias[other], bias[other], bias[other])
    for i in range(weight.shape[1]):
        value = x[group, i]
        sum += weight[row, i] * value
        beside += weight[other, i] * value
    for i in range(linear.shape[1]):
        value = first[group, i]
        sum += linear[row, i] * value
        beside += linear[other, i] * value
    if is_activated:
        sum = wp.cw_mul(sum, gate(sum))
        beside = wp.cw_mul(beside, gate(beside))
    y[group, row] = sum
    y[group, other] = beside
