//! Latent of an Attention-ODE from cached samples, with folded weights.
//!
//! The embedding is linear, so keys and values of every head are linear in the standardised sample z. All of that
//! folds into two products at load (in f64, once), and z itself is the one key and value that is cached, written once
//! when its sample comes in. With z_l the sample `l` steps back:
//!
//! ```text
//! u_j     = (W_k W_e)_j^T (W_q W_e z_0 + ..)_j / sqrt(d)     per head j; what all lags share leaves the softmax alone
//! score_l = u_j . z_l - slope l + bias_l,  m_j = sum_l softmax(score)_l z_l
//! h       = P_0 z_0 + sum_j P_j m_j + c
//! ```
//!
//! Memory: a ring, `[slot of the newest sample, z of slot 0 [n], .., z of slot W-1 [n]]`. A step writes one slot, reads
//! all of them once, and multiplies no matrix but for the newest.

use candle_core::{Result, Tensor};
use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::sample_ring::newest;
use crate::{
    architectures::{AttentionOdeConfig, sample_attention::SampleAttention},
    kernel::{Panels, multiply_row, softmax},
    operations::attention::slope,
};

/// Numbers that are summed side by side; rows are padded to a multiple.
const LANES: usize = 16;

/// The folded weights.
#[derive(Clone, Debug)]
pub(super) struct AttentionCache {
    window: usize,
    heads: usize,
    inputs: usize,
    latent: usize,
    /// z_0 [n] -> u [H n].
    query: (Panels<f32>, Vec<f32>),
    /// [z_0; m_1; ..; m_H] [(1 + H) n] -> h [l].
    output: (Panels<f32>, Vec<f32>),
    /// bias_l - slope l, [H, W] by lag.
    lag_bias: Vec<f32>,
}

pub(super) fn matrix(tensor: &Tensor) -> Result<DMatrix<f64>> {
    let (rows, columns) = tensor.dims2()?;
    let values = tensor
        .to_dtype(candle_core::DType::F64)?
        .flatten_all()?
        .to_vec1::<f64>()?;
    Ok(DMatrix::from_row_slice(rows, columns, &values))
}

pub(super) fn vector(tensor: &Tensor) -> Result<DVector<f64>> {
    Ok(DVector::from_vec(
        tensor.to_dtype(candle_core::DType::F64)?.to_vec1::<f64>()?,
    ))
}

/// y = M x + c, packed.
pub(super) fn packed(matrix: &DMatrix<f64>, offset: &DVector<f64>) -> (Panels<f32>, Vec<f32>) {
    let rows: Vec<f32> = matrix
        .transpose()
        .iter()
        .map(|value| *value as f32)
        .collect();
    let panels = Panels::transposed(&rows, matrix.ncols(), matrix.nrows());
    (panels, offset.iter().map(|value| *value as f32).collect())
}

impl AttentionCache {
    pub(super) fn new(config: &AttentionOdeConfig, model: &SampleAttention) -> Result<Self> {
        let (heads, width) = (config.heads, config.embedding);
        let depth = width / heads;
        let (embed, embed_bias) = (matrix(&model.embed.0)?, vector(&model.embed.1)?);
        let (qkv, qkv_bias) = (
            matrix(&model.attention.weight)?,
            vector(&model.attention.bias)?,
        );
        let (mix, mix_bias) = (matrix(&model.mix.0)?, vector(&model.mix.1)?);
        let (latent, latent_bias) = (matrix(&model.latent.0)?, vector(&model.latent.1)?);
        let inputs = embed.ncols();

        let mut query = DMatrix::zeros(heads * inputs, inputs);
        let mut query_bias = DVector::zeros(heads * inputs);
        let mut output = DMatrix::zeros(config.latent, (1 + heads) * inputs);
        let mut output_bias = &latent * (&embed_bias + mix_bias) + latent_bias;
        output.columns_mut(0, inputs).copy_from(&(&latent * &embed));
        for head in 0..heads {
            let part = |index: usize| qkv.rows(index * width + head * depth, depth);
            let offset = |index: usize| qkv_bias.rows(index * width + head * depth, depth);
            let keys = (part(1) * &embed).transpose() / (depth as f64).sqrt();
            query
                .rows_mut(head * inputs, inputs)
                .copy_from(&(&keys * part(0) * &embed));
            query_bias
                .rows_mut(head * inputs, inputs)
                .copy_from(&(&keys * (part(0) * &embed_bias + offset(0))));
            let values = &latent * mix.columns(head * depth, depth);
            output
                .columns_mut((1 + head) * inputs, inputs)
                .copy_from(&(&values * part(2) * &embed));
            output_bias += &values * (part(2) * &embed_bias + offset(2));
        }
        let learned = model.attention.lag_bias.flatten_all()?.to_vec1::<f32>()?;
        let lag_bias = learned
            .into_iter()
            .enumerate()
            .map(|(i, bias)| bias - (slope(i / config.window) * (i % config.window) as f64) as f32)
            .collect();
        Ok(Self {
            window: config.window,
            heads,
            inputs,
            latent: config.latent,
            query: packed(&query, &query_bias),
            output: packed(&output, &output_bias),
            lag_bias,
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

    /// n, padded.
    fn stride(&self) -> usize {
        self.inputs.next_multiple_of(LANES)
    }

    /// Numbers of scratch that [`AttentionCache::latent`] takes: samples, queries and means, each row padded, softmax weights,
    /// and a row and a column of numbers side by side.
    pub(super) fn scratch(&self) -> usize {
        (self.window + 2 * self.heads) * self.stride()
            + self.window
            + (1 + 2 * self.heads) * self.inputs
    }

    /// h [l] of a memory.
    pub(super) fn latent(
        &self,
        arch: Arch,
        memory: &[f64],
        latent: &mut [f32],
        scratch: &mut [f32],
    ) {
        let (inputs, stride) = (self.inputs, self.stride());
        let (samples, rest) = scratch.split_at_mut(self.window * stride);
        let (queries, rest) = rest.split_at_mut(self.heads * stride);
        let (means, rest) = rest.split_at_mut(self.heads * stride);
        let (weights, rest) = rest.split_at_mut(self.window);
        let (query, rest) = rest.split_at_mut(self.heads * inputs);
        let seen = &mut rest[..(1 + self.heads) * inputs];

        let newest = newest(memory, self.window);
        arch.dispatch(Widen {
            memory: &memory[1..],
            inputs,
            samples,
        });
        let z = &samples[newest * stride..][..inputs];
        query.copy_from_slice(&self.query.1);
        multiply_row(arch, query, z, &self.query.0);
        for (row, query) in queries
            .chunks_exact_mut(stride)
            .zip(query.chunks_exact(inputs))
        {
            let (row, padding) = row.split_at_mut(inputs);
            row.copy_from_slice(query);
            padding.fill(0.0);
        }
        arch.dispatch(Attend {
            samples,
            queries,
            lag_bias: &self.lag_bias,
            newest,
            weights,
            means,
        });
        seen[..inputs].copy_from_slice(z);
        for (seen, mean) in seen[inputs..]
            .chunks_exact_mut(inputs)
            .zip(means.chunks_exact(stride))
        {
            seen.copy_from_slice(&mean[..inputs]);
        }
        latent.copy_from_slice(&self.output.1);
        multiply_row(arch, latent, seen, &self.output.0);
    }
}

/// The memory's samples [W, n] in f32, padded with zeros to [W, stride].
struct Widen<'a> {
    memory: &'a [f64],
    inputs: usize,
    samples: &'a mut [f32],
}

impl WithSimd for Widen<'_> {
    type Output = ();

    // Plain loops, which the compiler vectorises for the instructions at hand.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let stride = self.inputs.next_multiple_of(LANES);
        for (row, z) in self
            .samples
            .chunks_exact_mut(stride)
            .zip(self.memory.chunks_exact(self.inputs))
        {
            let (row, padding) = row.split_at_mut(self.inputs);
            for (slot, z) in row.iter_mut().zip(z) {
                *slot = *z as f32;
            }
            padding.fill(0.0);
        }
    }
}

/// Softmax-weighted means of the samples, head by head. Sums run in a fixed order: the same numbers on every machine.
struct Attend<'a> {
    /// [W, stride], by slot.
    samples: &'a [f32],
    /// [H, stride].
    queries: &'a [f32],
    /// [H, W], by lag.
    lag_bias: &'a [f32],
    /// Slot of lag 0.
    newest: usize,
    /// [W].
    weights: &'a mut [f32],
    /// [H, stride].
    means: &'a mut [f32],
}

impl WithSimd for Attend<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            samples,
            queries,
            lag_bias,
            newest,
            weights,
            means,
        } = self;
        let window = weights.len();
        let stride = samples.len() / window;
        for ((query, mean), lag_bias) in queries
            .chunks_exact(stride)
            .zip(means.chunks_exact_mut(stride))
            .zip(lag_bias.chunks_exact(window))
        {
            for (weight, z) in weights.iter_mut().zip(samples.chunks_exact(stride)) {
                *weight = dot(query, z);
            }
            // Lag 0 stands in the newest slot, and lags run backwards through the ring.
            let (first, rest) = lag_bias.split_at(newest + 1);
            for (weight, bias) in weights[..=newest].iter_mut().rev().zip(first) {
                *weight += bias;
            }
            for (weight, bias) in weights[newest + 1..].iter_mut().rev().zip(rest) {
                *weight += bias;
            }
            softmax(simd, weights);
            mean.fill(0.0);
            for (weight, z) in weights.iter().zip(samples.chunks_exact(stride)) {
                for (mean, z) in mean.iter_mut().zip(z) {
                    *mean += weight * z;
                }
            }
        }
    }
}

/// a . b of a multiple of [`LANES`] numbers.
#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    for (a, b) in a
        .as_chunks::<LANES>()
        .0
        .iter()
        .zip(b.as_chunks::<LANES>().0)
    {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            sums[i] += sums[i + half];
        }
        half /= 2;
    }
    sums[0]
}
