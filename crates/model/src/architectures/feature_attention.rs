//! The latent by attention over the condition vector: each encoded number of a window is a token, and the tokens attend to
//! each other.
//!
//! ```text
//! e_i = z_i t_i + b_i                                    learned embedding of number i, i = 1 .. N = W n, newest sample first
//! o_i = sum_j softmax_j(q_i . k_j / sqrt(d)) v_j         q, k, v = W e + c, head by head; no slopes
//! h   = W_h mean_i (e_i + W_o o_i + b_o) + b_h
//! ```
//!
//! The paper's "self-attention to compress the input bottleneck of the condition vector", h = Attention(x). Embeddings are
//! linear in z, so scores are made of products of two embeddings that no sample changes ([`FeatureAttention::tables`]), and
//! the mean needs of the weights their means over i alone: `operations/token_weights.rs` has those.

use candle_core::{D, Result, Tensor};
use candle_nn::{Init, VarBuilder};

use super::{
    attention_config::AttentionOdeConfig,
    linear::{affine, linear},
};
use crate::operations::{Backend, token_weights::token_weights};

/// The layers in Candle.
#[derive(Clone, Debug)]
pub(crate) struct FeatureAttention {
    window: usize,
    heads: usize,
    /// t, b [N, E].
    pub(crate) tokens: (Tensor, Tensor),
    /// W_q, W_k, W_v one above the other, [3 E, E]; c [3 E].
    pub(crate) qkv: (Tensor, Tensor),
    /// W_o [E, E], b_o [E].
    pub(crate) mix: (Tensor, Tensor),
    /// W_h [l, E], b_h [l].
    pub(crate) latent: (Tensor, Tensor),
}

impl FeatureAttention {
    /// Weights `tokens.*`, `attention.qkv.*`, `mix.*`, `latent.*` for `inputs` encoded numbers a sample.
    pub(super) fn new(config: &AttentionOdeConfig, inputs: usize, vb: &VarBuilder) -> Result<Self> {
        let (count, width) = (config.window * inputs, config.embedding);
        let uniform = |up: f64| Init::Uniform { lo: -up, up };
        let tokens = vb.pp("tokens");
        let qkv = vb.pp("attention").pp("qkv");
        let narrow = 1.0 / (width as f64).sqrt();
        Ok(Self {
            window: config.window,
            heads: config.heads,
            tokens: (
                tokens.get_with_hints((count, width), "weight", uniform(3f64.sqrt()))?,
                tokens.get_with_hints((count, width), "bias", uniform(1.0))?,
            ),
            qkv: (
                qkv.get_with_hints((3 * width, width), "weight", uniform(narrow))?,
                qkv.get_with_hints(3 * width, "bias", Init::Const(0.0))?,
            ),
            mix: linear(vb, "mix", width, width, 1.0)?,
            // The mean of so many tokens is as much smaller than one of them.
            latent: linear(vb, "latent", width, config.latent, (count as f64).sqrt())?,
        })
    }

    /// z [B, W-1+S, n] -> h [B, S, l].
    pub(super) fn latents(&self, operations: Backend, z: &Tensor) -> Result<Tensor> {
        let (rows, batch) = (self.rows(z)?, z.dim(0)?);
        let weights = token_weights(operations, &rows, &self.tables()?)?;
        let pooled =
            (self.mean_embedding(&rows)? + affine(&self.pooled(&rows, &weights)?, &self.mix)?)?;
        affine(&pooled, &self.latent)?.reshape((batch, rows.dim(0)? / batch, ()))
    }

    /// Weight on each number of the window, newest sample first, mean over the attending numbers, [B S, H, N], of
    /// z [B, W-1+S, n].
    pub(super) fn weights(&self, z: &Tensor) -> Result<Tensor> {
        token_weights(Backend::Kernels, &self.rows(z)?, &self.tables()?)
    }

    /// h [1, l] of one window z [W, n]: attention as it is written, by Candle's own operations and without threads.
    pub(super) fn single(&self, z: &Tensor) -> Result<Tensor> {
        let newest_first: Vec<u32> = (0..self.window as u32).rev().collect();
        let order = Tensor::new(newest_first, z.device())?;
        let column = z.index_select(&order, 0)?.reshape(((), 1))?;
        let tokens = (column.broadcast_mul(&self.tokens.0)? + &self.tokens.1)?;
        let (count, width) = tokens.dims2()?;
        let depth = width / self.heads;
        let qkv = affine(&tokens, &self.qkv)?;
        let mut heads = Vec::with_capacity(self.heads);
        for head in 0..self.heads {
            let part = |which: usize| {
                qkv.narrow(1, which * width + head * depth, depth)?
                    .contiguous()
            };
            let scores = (part(0)?.matmul(&part(1)?.t()?)? / (depth as f64).sqrt())?;
            let powers = scores
                .broadcast_sub(&scores.max_keepdim(D::Minus1)?)?
                .exp()?;
            let weights = powers.broadcast_div(&powers.sum_keepdim(D::Minus1)?)?;
            heads.push(weights.matmul(&part(2)?)?);
        }
        let mixed = (&tokens + affine(&Tensor::cat(&heads, 1)?, &self.mix)?)?;
        let pooled = (mixed.sum_keepdim(0)? / count as f64)?;
        affine(&pooled, &self.latent)
    }

    /// The windows of z [B, W-1+S, n] as rows [B S, N], newest sample first.
    fn rows(&self, z: &Tensor) -> Result<Tensor> {
        let (batch, samples, inputs) = z.dims3()?;
        let steps = samples + 1 - self.window;
        let lags = (0..self.window)
            .map(|lag| z.narrow(1, self.window - 1 - lag, steps))
            .collect::<Result<Vec<_>>>()?;
        Tensor::cat(&lags, 2)?.reshape((batch * steps, self.window * inputs))
    }

    /// Part 0 q, 1 k, 2 v of what each token adds: what z_i scales and what it does not, both [H, N, d].
    fn projected(&self, which: usize) -> Result<(Tensor, Tensor)> {
        let (count, width) = self.tokens.0.dims2()?;
        let weight = self.qkv.0.narrow(0, which * width, width)?.t()?;
        let offset = self.qkv.1.narrow(0, which * width, width)?;
        let by_head = |rows: Tensor| {
            rows.reshape((count, self.heads, width / self.heads))?
                .transpose(0, 1)?
                .contiguous()
        };
        Ok((
            by_head(self.tokens.0.matmul(&weight)?)?,
            by_head(self.tokens.1.matmul(&weight)?.broadcast_add(&offset)?)?,
        ))
    }

    /// P, Q, U, V [4, H, N, N] of score_ij = z_i z_j P_ij + z_i Q_ij + z_j U_ij + V_ij.
    pub(crate) fn tables(&self) -> Result<Tensor> {
        let (queries, query_offsets) = self.projected(0)?;
        let (keys, key_offsets) = self.projected(1)?;
        let scale = 1.0 / (queries.dim(2)? as f64).sqrt();
        let product = |query: &Tensor, key: &Tensor| query.matmul(&key.t()?.contiguous()?)? * scale;
        let all = [
            product(&queries, &keys)?,
            product(&queries, &key_offsets)?,
            product(&query_offsets, &keys)?,
            product(&query_offsets, &key_offsets)?,
        ];
        Tensor::stack(&all, 0)
    }

    /// mean_i e_i of rows z [R, N], [R, E].
    fn mean_embedding(&self, rows: &Tensor) -> Result<Tensor> {
        let count = self.tokens.0.dim(0)? as f64;
        let moving = rows.matmul(&self.tokens.0)?;
        (moving.broadcast_add(&self.tokens.1.sum(0)?)? / count)?.contiguous()
    }

    /// mean_i o_i of rows z [R, N] with weights [R, H, N], [R, E].
    fn pooled(&self, rows: &Tensor, weights: &Tensor) -> Result<Tensor> {
        let (values, value_offsets) = self.projected(2)?;
        let by_head = weights.transpose(0, 1)?.contiguous()?;
        let moving = by_head
            .broadcast_mul(&rows.unsqueeze(0)?)?
            .matmul(&values)?;
        let attended = (moving + by_head.matmul(&value_offsets)?)?;
        // [H, R, d] -> [R, E].
        attended
            .transpose(0, 1)?
            .contiguous()?
            .reshape((rows.dim(0)?, ()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        architectures::{AttentionOdeConfig, attention_config::Tokens},
        testing::{check_gradient, in_f64, numbers, ramp, weighted},
    };

    fn small(window: usize) -> (FeatureAttention, Vec<(String, candle_core::Var)>) {
        let config = AttentionOdeConfig {
            window,
            heads: 2,
            embedding: 8,
            latent: 5,
            tokens: Tokens::Features,
            ..AttentionOdeConfig::default()
        };
        in_f64(|vb| FeatureAttention::new(&config, 4, &vb))
    }

    #[test]
    fn folded_attention_is_attention_as_it_is_written() {
        for window in [1, 3] {
            let (model, _) = small(window);
            let z = ramp(&[2, window - 1 + 6, 4], 0.53);
            for operations in [Backend::Kernels, Backend::Tensors] {
                let folded = model.latents(operations, &z).expect("runs");
                for (row, at) in [(0, 0), (1, 5), (0, 3)] {
                    let single = z
                        .get(row)
                        .and_then(|z| model.single(&z.narrow(0, at, window)?))
                        .expect("runs");
                    let wanted = folded.get(row).and_then(|h| h.get(at)).expect("there");
                    for (a, b) in numbers(&single).iter().zip(numbers(&wanted)) {
                        assert!((a - b).abs() < 1e-12, "{a} {b}, window {window}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        let (model, vars) = small(2);
        let z = ramp(&[3, 1 + 5, 4], 0.53);
        for operations in [Backend::Kernels, Backend::Tensors] {
            check_gradient(&vars, || {
                weighted(&model.latents(operations, &z).expect("runs"))
            });
        }
    }

    #[test]
    fn weights_sum_to_one() {
        let (model, _) = small(2);
        let found = model.weights(&ramp(&[3, 1 + 5, 4], 0.53)).expect("found");
        assert_eq!(found.dims(), [15, 2, 8]);
        let found = found.flatten(0, 1).and_then(|rows| rows.to_vec2::<f64>());
        for head in &found.expect("numbers") {
            assert!((head.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(
                head.iter().any(|weight| (weight - 0.125).abs() > 1e-3),
                "{head:?}"
            );
        }
    }
}
