//! Mean attention weight by head and lag.

use candle_core::{Device, Tensor};
use hydro_model::{ForceModel, ModelError, Network};

use crate::dataset::Split;

/// Trajectories that are looked at.
const TRAJECTORIES: usize = 20;

/// Mean weight of each lag, newest first, `[H][W]`, over the samples of some trajectories of a split; None for a model without
/// attention.
///
/// # Errors
/// A split of other features.
pub fn attention_by_lag(
    model: &ForceModel,
    split: &Split,
) -> Result<Option<Vec<Vec<f64>>>, ModelError> {
    let Network::AttentionOde(network) = &model.network else {
        return Ok(None);
    };
    let (padding, count) = (model.window() - 1, split.len().min(TRAJECTORIES));
    let mut z = Vec::new();
    for index in 0..count {
        model.encode_padded(split.x(index), padding, &mut z);
    }
    let shape = (count, padding + split.samples(), model.encoder.len());
    let z = Tensor::from_vec(z, shape, &Device::Cpu)?;
    Ok(Some(network.mean_weights(&z)?))
}
