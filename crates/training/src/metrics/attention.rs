//! Attention of a trained Attention-ODE: how far its weights are from uniform, and its error with others in their place.

use candle_core::{DType, Device, Tensor};
use hydro_model::{
    AttentionOdeConfig, ForceModel, ModelConfig, ModelError, Network, Tokens,
    checkpoint::{Checkpoint, CheckpointError},
};
use serde::Serialize;

use super::{InitialForce, evaluate};
use crate::{TrainError, dataset::Split};

/// Trajectories whose weights are looked at.
const TRAJECTORIES: usize = 20;
/// Score that leaves nothing to a sample.
const NOTHING: f64 = -1e4;

/// The attention of a trained model on a split.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AttentionUse {
    /// Mean weight `[H][N]` of each token: of each lag, newest first, or of each number of the window.
    pub mean: Vec<Vec<f64>>,
    /// Total variation of a sample's weights from 1/N, mean over samples, by head; 0 is uniform, 1 - 1/N one token alone.
    pub from_uniform: Vec<f64>,
    /// The same from `mean`: how much the weights depend on what is attended to.
    pub from_mean: Vec<f64>,
    /// The same from the weights that the fixed slopes alone give; None without slopes.
    pub from_slopes: Option<Vec<f64>>,
    /// Errors with other weights in place of the learned ones, the learned ones first.
    pub ablations: Vec<Ablation>,
}

/// Error with other weights of the attention.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ablation {
    /// Which ones: `learned`, `mean` (of the learned), `slopes`, `uniform`, `newest`.
    pub weights: &'static str,
    /// nRMSE over all outputs, from the true first force.
    pub nrmse: f64,
    /// The same without buoyancy.
    pub nrmse_hydrodynamic: f64,
}

/// Mean weight of each token `[H][N]` over the samples of some trajectories of a split; None for a model without attention.
///
/// # Errors
/// A split of other features.
pub fn mean_attention(
    model: &ForceModel,
    split: &Split,
) -> Result<Option<Vec<Vec<f64>>>, ModelError> {
    let weights = attention_weights(model, split)?;
    let mean = |weights: Tensor| weights.mean(0)?.to_vec2();
    Ok(weights.map(mean).transpose()?)
}

/// Looks at the attention of a checkpoint, and evaluates it with other weights; None for a model without attention.
///
/// # Errors
/// A split of other features or outputs.
pub fn attention_use(
    checkpoint: &Checkpoint,
    split: &Split,
) -> Result<Option<AttentionUse>, TrainError> {
    let ModelConfig::AttentionOde(config) = &checkpoint.card.model else {
        return Ok(None);
    };
    let Some(weights) = attention_weights(&checkpoint.model(None)?, split)? else {
        return Ok(None);
    };
    let mean: Vec<Vec<f64>> = weights
        .mean(0)
        .and_then(|mean| mean.to_vec2())
        .map_err(ModelError::from)?;
    let slopes = (config.tokens == Tokens::Samples).then(|| by_slopes(config));
    let uniform = vec![vec![1.0 / mean[0].len() as f64; mean[0].len()]; mean.len()];
    let apart = |from: &[Vec<f64>]| total_variation(&weights, from);
    let (from_uniform, from_mean) = (apart(&uniform)?, apart(&mean)?);
    let from_slopes = slopes.as_deref().map(apart).transpose()?;

    let mut others = Vec::new();
    if let Some(slopes) = &slopes {
        let newest = mean.iter().map(|head| {
            let score = |lag| if lag == 0 { 0.0 } else { NOTHING };
            (0..head.len()).map(score).collect()
        });
        others.push(("mean", logarithms(&mean)));
        others.push(("slopes", logarithms(slopes)));
        others.push(("uniform", logarithms(&uniform)));
        others.push(("newest", newest.collect()));
    } else {
        others.push(("uniform", logarithms(&uniform)));
    }
    let mut ablations = vec![ablation("learned", checkpoint, split)?];
    for (name, scores) in others {
        let changed = with_scores(checkpoint, config, &scores)?;
        ablations.push(ablation(name, &changed, split)?);
    }
    Ok(Some(AttentionUse {
        mean,
        from_uniform,
        from_mean,
        from_slopes,
        ablations,
    }))
}

fn ablation(
    weights: &'static str,
    checkpoint: &Checkpoint,
    split: &Split,
) -> Result<Ablation, TrainError> {
    let errors = evaluate(checkpoint, split, InitialForce::Clean)?.errors;
    Ok(Ablation {
        weights,
        nrmse: errors.pooled,
        nrmse_hydrodynamic: errors.pooled_hydrodynamic,
    })
}

/// Weights [S, H, N] at the samples of some trajectories, in double precision.
fn attention_weights(model: &ForceModel, split: &Split) -> Result<Option<Tensor>, ModelError> {
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
    Ok(Some(network.weights(&z)?.to_dtype(DType::F64)?))
}

/// Half the sum of |w - from|, mean over samples, by head; weights [S, H, N], from [H][N].
fn total_variation(weights: &Tensor, from: &[Vec<f64>]) -> Result<Vec<f64>, ModelError> {
    let from = Tensor::new(from.to_vec(), weights.device())?;
    let apart = weights.broadcast_sub(&from)?.abs()?.sum(2)?;
    Ok((apart.mean(0)? * 0.5)?.to_vec1()?)
}

/// Softmax of the fixed slopes alone, [H][W].
fn by_slopes(config: &AttentionOdeConfig) -> Vec<Vec<f64>> {
    let of_head = |head| {
        let power = |lag| (-AttentionOdeConfig::slope(head) * lag as f64).exp();
        let powers: Vec<f64> = (0..config.window).map(power).collect();
        let sum: f64 = powers.iter().sum();
        powers.into_iter().map(|power| power / sum).collect()
    };
    (0..config.heads).map(of_head).collect()
}

fn logarithms(weights: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let of_head = |head: &Vec<f64>| head.iter().map(|weight| weight.max(1e-300).ln()).collect();
    weights.iter().map(of_head).collect()
}

/// The checkpoint with these scores [H][W] at every sample: no queries, and a bias by lag that makes up for the slopes. Over
/// features there is no such bias, and without queries the weights are uniform.
fn with_scores(
    checkpoint: &Checkpoint,
    config: &AttentionOdeConfig,
    scores: &[Vec<f64>],
) -> Result<Checkpoint, CheckpointError> {
    let mut weights = checkpoint.weights().clone();
    let width = config.embedding;
    for (name, tensor) in &mut weights {
        let changed = match name.as_str() {
            "attention.qkv.weight" | "attention.qkv.bias" => without_queries(tensor, width),
            "attention.lag_bias" => lag_bias(scores),
            _ => continue,
        };
        *tensor = changed.map_err(ModelError::from)?;
    }
    Checkpoint::new(checkpoint.card.clone(), weights)
}

/// The first `width` rows set to zero.
fn without_queries(qkv: &Tensor, width: usize) -> candle_core::Result<Tensor> {
    let rest = qkv.narrow(0, width, qkv.dim(0)? - width)?;
    Tensor::cat(&[qkv.narrow(0, 0, width)?.zeros_like()?, rest], 0)
}

fn lag_bias(scores: &[Vec<f64>]) -> candle_core::Result<Tensor> {
    let of_head = |(head, scores): (usize, &Vec<f64>)| {
        let raised =
            |(lag, score): (usize, &f64)| score + AttentionOdeConfig::slope(head) * lag as f64;
        scores.iter().enumerate().map(raised).collect::<Vec<f64>>()
    };
    let rows: Vec<Vec<f64>> = scores.iter().enumerate().map(of_head).collect();
    Tensor::new(rows, &Device::Cpu)?.to_dtype(DType::F32)
}

#[cfg(test)]
#[path = "tests/attention.rs"]
mod tests;
