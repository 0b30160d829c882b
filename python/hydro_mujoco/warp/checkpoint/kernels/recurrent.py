"""Cells of an LSTM: Warp kernels (crates/model/src/engine/lstm_engine.rs)."""

import warp as wp

from .dense import gate
from .relaxing import chosen
from .stepping import all_of

wp.set_module_options({"enable_backward": False})


@wp.func
def hyperbolic(x: wp.vec4) -> wp.vec4:
    """tanh of each number."""
    return 2.0 * gate(2.0 * x) - all_of(1.0)


@wp.kernel
def join(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    x: wp.array2d[wp.vec4],
    h: wp.array2d[wp.vec4],
    # Out
    input: wp.array2d[wp.vec4],
):
    """What a layer reads: its input, then its own numbers, which are 0 at a start."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    inputs = input.shape[1] - h.shape[1]
    if i < inputs:
        input[group, i] = x[group, i]
    else:
        input[group, i] = chosen(all_of(0.0), h[group, i - inputs], starts[group, 0])


@wp.kernel
def turn(
    starts: wp.array2d[wp.vec4],
    due: wp.array2d[wp.vec4],
    gates: wp.array2d[wp.vec4],
    # Memory
    c: wp.array2d[wp.vec4],
    h: wp.array2d[wp.vec4],
):
    """The cell and the numbers of a layer one sample on; gates: input, forget, cell, output, by rows."""
    group, i = wp.tid()
    if wp.length_sq(due[group, 0]) == 0.0:
        return
    width = h.shape[1]
    before = chosen(all_of(0.0), c[group, i], starts[group, 0])
    cell = wp.cw_mul(gate(gates[group, width + i]), before)
    cell += wp.cw_mul(gate(gates[group, i]), hyperbolic(gates[group, 2 * width + i]))
    c[group, i] = chosen(cell, c[group, i], due[group, 0])
    after = wp.cw_mul(gate(gates[group, 3 * width + i]), hyperbolic(cell))
    h[group, i] = chosen(after, h[group, i], due[group, 0])
