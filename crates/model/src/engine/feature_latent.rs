//! Latent of an Attention-ODE whose tokens are the numbers of the window, with folded weights.
//!
//! Scores are the tables of `architectures/feature_attention.rs`, made once at load in f64; what the latent needs of the
//! weights are their means a_j of each head, so that
//!
//! ```text
//! h = P z + sum_heads (A (a z) + B a) + c         a z element by element
//! ```
//!
//! is one product. Memory: the ring of `sample_ring.rs`.

use candle_core::{DType, Result, Tensor};
use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

use super::{
    attention_cache::{matrix, packed, vector},
    sample_ring::newest,
};
use crate::{
    architectures::{AttentionOdeConfig, feature_attention::FeatureAttention},
    kernel::{Panels, multiply_row, softmax},
};

/// The folded weights.
#[derive(Clone, Debug)]
pub(super) struct FeatureLatent {
    window: usize,
    heads: usize,
    latent: usize,
    /// N, numbers of the window.
    count: usize,
    /// P, Q, U, V by head: [H, 4, N, N].
    tables: Vec<f32>,
    /// [z; a_1 z; a_1; ..; a_H z; a_H] [(1 + 2 H) N] -> h [l].
    output: (Panels<f32>, Vec<f32>),
}

impl FeatureLatent {
    pub(super) fn new(config: &AttentionOdeConfig, layers: &FeatureAttention) -> Result<Self> {
        let (tokens, offsets) = (matrix(&layers.tokens.0)?, matrix(&layers.tokens.1)?);
        let (count, width) = tokens.shape();
        let (heads, depth) = (config.heads, width / config.heads);
        let (qkv, qkv_bias) = (matrix(&layers.qkv.0)?, vector(&layers.qkv.1)?);
        let (mix, mix_bias) = (matrix(&layers.mix.0)?, vector(&layers.mix.1)?);
        let (latent, latent_bias) = (matrix(&layers.latent.0)?, vector(&layers.latent.1)?);

        let mut output = DMatrix::zeros(config.latent, (1 + 2 * heads) * count);
        let share = 1.0 / count as f64;
        output
            .columns_mut(0, count)
            .copy_from(&(&latent * tokens.transpose() * share));
        let mean_offset = offsets.row_sum().transpose() * share;
        let output_bias = &latent * (mean_offset + mix_bias) + latent_bias;
        for head in 0..heads {
            let rows = 2 * width + head * depth;
            let project = qkv.rows(rows, depth).transpose();
            let out = &latent * mix.columns(head * depth, depth);
            let mut steady = &offsets * &project;
            for mut row in steady.row_iter_mut() {
                row += qkv_bias.rows(rows, depth).transpose();
            }
            let at = (1 + 2 * head) * count;
            output
                .columns_mut(at, count)
                .copy_from(&(&out * (&tokens * &project).transpose()));
            output
                .columns_mut(at + count, count)
                .copy_from(&(&out * steady.transpose()));
        }
        Ok(Self {
            window: config.window,
            heads,
            latent: config.latent,
            count,
            tables: by_head(&layers.tables()?)?,
            output: packed(&output, &output_bias),
        })
    }

    /// W.
    pub(super) fn window(&self) -> usize {
        self.window
    }

    /// l.
    pub(super) fn latent_len(&self) -> usize {
        self.latent
    }

    /// Numbers of scratch that [`FeatureLatent::latent`] takes: what the output reads, and one row of scores.
    pub(super) fn scratch(&self) -> usize {
        (2 + 2 * self.heads) * self.count
    }

    /// h [l] of a memory.
    pub(super) fn latent(
        &self,
        arch: Arch,
        memory: &[f64],
        latent: &mut [f32],
        scratch: &mut [f32],
    ) {
        let (seen, rest) = scratch.split_at_mut((1 + 2 * self.heads) * self.count);
        let (z, weighed) = seen.split_at_mut(self.count);
        let inputs = self.count / self.window;
        let newest = newest(memory, self.window);
        for (lag, slot) in z.chunks_exact_mut(inputs).enumerate() {
            let at = (newest + self.window - lag) % self.window;
            let sample = &memory[1 + at * inputs..][..inputs];
            for (slot, value) in slot.iter_mut().zip(sample) {
                *slot = *value as f32;
            }
        }
        arch.dispatch(Weigh {
            z,
            tables: &self.tables,
            weighed,
            scores: &mut rest[..self.count],
        });
        latent.copy_from_slice(&self.output.1);
        multiply_row(arch, latent, seen, &self.output.0);
    }
}

/// Tables [4, H, N, N] in the order [H, 4, N, N], so that a head reads memory in one piece.
fn by_head(tables: &Tensor) -> Result<Vec<f32>> {
    tables
        .transpose(0, 1)?
        .to_dtype(DType::F32)?
        .flatten_all()?
        .to_vec1()
}

/// Mean softmax weights of every head, and their products with z.
struct Weigh<'a> {
    /// [N].
    z: &'a [f32],
    /// [H, 4, N, N].
    tables: &'a [f32],
    /// a z and a of each head, [H, 2, N].
    weighed: &'a mut [f32],
    /// [N].
    scores: &'a mut [f32],
}

impl WithSimd for Weigh<'_> {
    type Output = ();

    // Plain loops, which the compiler vectorises for the instructions at hand.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            z,
            tables,
            weighed,
            scores,
        } = self;
        let (count, share) = (z.len(), 1.0 / z.len() as f32);
        let square = count * count;
        for (tables, out) in tables
            .chunks_exact(4 * square)
            .zip(weighed.chunks_exact_mut(2 * count))
        {
            let (products, means) = out.split_at_mut(count);
            means.fill(0.0);
            for (i, own) in z.iter().enumerate() {
                let row = |which: usize| &tables[which * square + i * count..][..count];
                let (p, q, u, v) = (row(0), row(1), row(2), row(3));
                for j in 0..count {
                    scores[j] = (own * p[j] + u[j]) * z[j] + (own * q[j] + v[j]);
                }
                softmax(simd, scores);
                for (mean, weight) in means.iter_mut().zip(&*scores) {
                    *mean += share * weight;
                }
            }
            for ((product, mean), z) in products.iter_mut().zip(&*means).zip(z) {
                *product = mean * z;
            }
        }
    }
}
