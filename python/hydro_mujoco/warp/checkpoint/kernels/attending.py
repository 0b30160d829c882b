"""Attention of the newest sample over a window: Warp kernel (crates/model/src/engine/attention_cache.rs)."""

import warp as wp

from .stepping import all_of

wp.set_module_options({"enable_backward": False})


@wp.func
def exponential(x: wp.vec4) -> wp.vec4:
    """exp of each number."""
    for i in range(4):
        x[i] = wp.exp(x[i])
    return x


@wp.kernel
def attend(
    due: wp.array2d[wp.vec4],
    window: wp.array3d[wp.vec4],
    queries: wp.array2d[wp.vec4],
    lag_bias: wp.array2d[float],
    # Scratch, out
    scores: wp.array3d[wp.vec4],
    seen: wp.array2d[wp.vec4],
):
    """Mean of a window's samples, weighted by the softmax of their scores, of each head; seen: newest sample, means."""
    group, head = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    lags, numbers = window.shape[1], window.shape[2]
    largest = all_of(-3.0e38)
    for lag in range(lags):
        score = all_of(lag_bias[head, lag])
        for i in range(numbers):
            score += wp.cw_mul(queries[group, head * numbers + i], window[group, lag, i])
        scores[group, head, lag] = score
        largest = wp.max(largest, score)
    sum = all_of(0.0)
    for lag in range(lags):
        power = exponential(scores[group, head, lag] - largest)
        scores[group, head, lag] = power
        sum += power
    for i in range(numbers):
        mean = all_of(0.0)
        for lag in range(lags):
            mean += wp.cw_mul(scores[group, head, lag], window[group, lag, i])
        seen[group, (1 + head) * numbers + i] = wp.cw_div(mean, sum)
        if head == 0:
            seen[group, i] = window[group, 0, i]
