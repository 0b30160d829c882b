//! Linear layers: their weights, their product.

use candle_core::{Result, Tensor};
use candle_nn::{Init, VarBuilder};

/// x [rows, inputs] -> x W^T + b.
pub(super) fn affine(x: &Tensor, (weight, bias): &(Tensor, Tensor)) -> Result<Tensor> {
    x.matmul(&weight.t()?)?.broadcast_add(bias)
}

/// Weights `name.*` of a linear layer, drawn so that its outputs have `gain` times the deviation of its inputs.
pub(super) fn linear(
    vb: &VarBuilder,
    name: &str,
    inputs: usize,
    outputs: usize,
    gain: f64,
) -> Result<(Tensor, Tensor)> {
    let up = gain * (3.0 / inputs as f64).sqrt();
    let vb = vb.pp(name);
    let weight = vb.get_with_hints((outputs, inputs), "weight", Init::Uniform { lo: -up, up })?;
    Ok((
        weight,
        vb.get_with_hints(outputs, "bias", Init::Const(0.0))?,
    ))
}
