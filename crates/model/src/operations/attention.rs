//! Attention of the newest sample over a window of past samples, as one differentiable operation.
//!
//! From queries, keys and values of all samples it computes sum_l softmax(score)_l v_l for every window and head; the
//! formula of the scores stands in [`crate::architectures::attention`]. The kernel has a backward pass of its own and runs
//! in parallel over trajectories; in tensor operations the same sum is made lag by lag.

use candle_core::{D, Result, Shape, Tensor};
use rayon::prelude::*;

use super::{
    backend::Backend,
    custom_operation::{BackwardPass, Operation, apply_2, values},
    softmax::softmax,
};
use crate::kernel::{Real, dot, sum_in_order};

/// Sizes of an attention layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct AttentionConfig {
    /// E, length of an embedding.
    pub(crate) embedding: usize,
    /// H, dividing E.
    pub(crate) heads: usize,
    /// W, samples seen, the newest included.
    pub(crate) window: usize,
}

impl Default for AttentionConfig {
    fn default() -> Self {
        Self {
            embedding: 64,
            heads: 4,
            window: 16,
        }
    }
}

/// Fixed slope of a head.
pub(crate) fn slope(head: usize) -> f64 {
    4f64.powi(1 - head as i32)
}

/// q, k and v side by side [B, W-1+S, 3 E], lag bias [H, W] -> attended values [B, S, E].
pub(crate) fn attend(
    backend: Backend,
    config: &AttentionConfig,
    qkv: &Tensor,
    lag_bias: &Tensor,
) -> Result<Tensor> {
    match backend {
        Backend::Kernels => apply_2(Window(config.clone()), [qkv, lag_bias]),
        Backend::Tensors => attend_by_tensors(config, qkv, lag_bias),
    }
}

/// [`Window`] in Candle's own operations, lag by lag for all samples at once.
fn attend_by_tensors(config: &AttentionConfig, qkv: &Tensor, lag_bias: &Tensor) -> Result<Tensor> {
    let weights = softmax_weights(config, qkv, lag_bias)?;
    let values = part(config, qkv, 2)?;
    let mut attended = lagged(config, &values, 0)?.broadcast_mul(&weights.narrow(3, 0, 1)?)?;
    for lag in 1..config.window {
        let value = lagged(config, &values, lag)?.broadcast_mul(&weights.narrow(3, lag, 1)?)?;
        attended = (attended + value)?;
    }
    let (batch, steps, ..) = attended.dims4()?;
    attended.reshape((batch, steps, config.embedding))
}

/// Queries (0), keys (1) or values (2) of all samples, [B, W-1+S, H, d].
fn part(config: &AttentionConfig, qkv: &Tensor, index: usize) -> Result<Tensor> {
    let AttentionConfig {
        embedding, heads, ..
    } = *config;
    let (batch, samples, _) = qkv.dims3()?;
    let part = qkv.narrow(2, index * embedding, embedding)?.contiguous()?;
    part.reshape((batch, samples, heads, embedding / heads))
}

/// The samples `lag` before the newest sample of each window: [B, W-1+S, ..] -> [B, S, ..].
fn lagged(config: &AttentionConfig, all: &Tensor, lag: usize) -> Result<Tensor> {
    let window = config.window;
    all.narrow(1, window - 1 - lag, all.dim(1)? + 1 - window)
}

/// Softmax weights by lag, [B, S, H, W].
pub(crate) fn softmax_weights(
    config: &AttentionConfig,
    qkv: &Tensor,
    lag_bias: &Tensor,
) -> Result<Tensor> {
    let AttentionConfig {
        embedding,
        heads,
        window,
    } = *config;
    let (queries, keys) = (part(config, qkv, 0)?, part(config, qkv, 1)?);
    let queries = lagged(config, &queries, 0)?;
    let scores = (0..window)
        .map(|lag| (&queries * lagged(config, &keys, lag)?)?.sum(D::Minus1))
        .collect::<Result<Vec<_>>>()?;
    let scores = (Tensor::stack(&scores, 3)? / ((embedding / heads) as f64).sqrt())?;
    let fixed: Vec<f64> = (0..heads)
        .flat_map(|head| (0..window).map(move |lag| slope(head) * lag as f64))
        .collect();
    let fixed = Tensor::from_vec(fixed, (heads, window), qkv.device())?;
    let bias = (lag_bias - fixed.to_dtype(qkv.dtype())?)?;
    let scores = scores.broadcast_add(&bias)?;

    // The largest score only guards the exponential: no gradient goes through it.
    let largest = scores.detach().max_keepdim(D::Minus1)?;
    let powers = scores.broadcast_sub(&largest)?.exp()?;
    powers.broadcast_div(&powers.sum_keepdim(D::Minus1)?)
}

/// qkv [B, W-1+S, 3 E], lag bias [H, W] -> [B, S, E].
struct Window(AttentionConfig);

/// One trajectory of the batch.
struct Row<'a, T> {
    config: &'a AttentionConfig,
    qkv: &'a [T],
    lag_bias: &'a [T],
}

impl<T: Real> Row<'_, T> {
    fn depth(&self) -> usize {
        self.config.embedding / self.config.heads
    }

    /// Part 0 q, 1 k, 2 v of a head at a position.
    fn range(&self, position: usize, part: usize, head: usize) -> std::ops::Range<usize> {
        let start = position * 3 * self.config.embedding
            + part * self.config.embedding
            + head * self.depth();
        start..start + self.depth()
    }

    /// Softmax weights by lag of the window that ends at `position`.
    fn weights(&self, position: usize, head: usize, weights: &mut [T]) {
        let window = self.config.window;
        let scale = T::real(1.0 / (self.depth() as f64).sqrt());
        let query = &self.qkv[self.range(position, 0, head)];
        for (lag, weight) in weights.iter_mut().enumerate() {
            let key = &self.qkv[self.range(position - lag, 1, head)];
            let product = dot(query, key);
            let fixed = T::real(slope(head) * lag as f64);
            *weight = product * scale - fixed + self.lag_bias[head * window + lag];
        }
        softmax(weights);
    }

    fn forward(&self, out: &mut [T]) {
        let AttentionConfig {
            embedding,
            heads,
            window,
        } = *self.config;
        let mut weights = vec![T::default(); window];
        for (sample, out) in out.chunks_exact_mut(embedding).enumerate() {
            let position = sample + window - 1;
            for (head, out) in out.chunks_exact_mut(embedding / heads).enumerate() {
                self.weights(position, head, &mut weights);
                for (lag, weight) in weights.iter().enumerate() {
                    let value = &self.qkv[self.range(position - lag, 2, head)];
                    for (out, value) in out.iter_mut().zip(value) {
                        *out += *weight * *value;
                    }
                }
            }
        }
    }

    /// Adds to the gradients of qkv and of the lag bias.
    fn backward(&self, gradient: &[T], d_qkv: &mut [T], d_bias: &mut [T]) {
        let AttentionConfig {
            embedding,
            heads,
            window,
        } = *self.config;
        let scale = T::real(1.0 / (self.depth() as f64).sqrt());
        let mut weights = vec![T::default(); window];
        let mut d_weights = vec![T::default(); window];
        let mut d_query = vec![T::default(); self.depth()];
        for (sample, gradient) in gradient.chunks_exact(embedding).enumerate() {
            let position = sample + window - 1;
            for (head, gradient) in gradient.chunks_exact(embedding / heads).enumerate() {
                self.weights(position, head, &mut weights);
                for (lag, (weight, d_weight)) in weights.iter().zip(&mut d_weights).enumerate() {
                    let range = self.range(position - lag, 2, head);
                    *d_weight = dot(gradient, &self.qkv[range.clone()]);
                    for (d, g) in d_qkv[range].iter_mut().zip(gradient) {
                        *d += *weight * *g;
                    }
                }
                // Through the softmax: ds = w (dw - sum w dw).
                let mean = dot(&weights, &d_weights);
                let query = self.range(position, 0, head);
                d_query.fill(T::default());
                for (lag, (weight, d_weight)) in weights.iter().zip(&d_weights).enumerate() {
                    let d_score = *weight * (*d_weight - mean);
                    d_bias[head * window + lag] += d_score;
                    let key = self.range(position - lag, 1, head);
                    let scaled = d_score * scale;
                    for (d, k) in d_query.iter_mut().zip(&self.qkv[key.clone()]) {
                        *d += scaled * *k;
                    }
                    for (d, q) in d_qkv[key].iter_mut().zip(&self.qkv[query.clone()]) {
                        *d += scaled * *q;
                    }
                }
                for (d, sum) in d_qkv[query].iter_mut().zip(&d_query) {
                    *d += *sum;
                }
            }
        }
    }
}

impl Window {
    fn row<'a, T: Real>(&'a self, qkv: &'a [T], lag_bias: &'a [T]) -> Row<'a, T> {
        Row {
            config: &self.0,
            qkv,
            lag_bias,
        }
    }
}

impl Operation<2> for Window {
    const NAME: &'static str = "window-attention";

    fn shape(&self, [qkv, _]: [&Shape; 2]) -> Result<Shape> {
        let (batch, samples, _) = qkv.dims3()?;
        Ok((batch, samples + 1 - self.0.window, self.0.embedding).into())
    }

    fn forward<T: Real>(
        &self,
        [qkv, lag_bias]: [&[T]; 2],
        [shape, _]: [&Shape; 2],
    ) -> Result<Vec<T>> {
        let (batch, samples, _) = shape.dims3()?;
        let out = samples + 1 - self.0.window;
        let mut values = vec![T::default(); batch * out * self.0.embedding];
        values
            .par_chunks_mut(out * self.0.embedding)
            .zip(qkv.par_chunks(samples * 3 * self.0.embedding))
            .for_each(|(out, qkv)| self.row(qkv, lag_bias).forward(out));
        Ok(values)
    }

    fn backward<T: Real>(&self, pass: &BackwardPass<'_, 2>) -> Result<[Option<Vec<T>>; 2]> {
        let [qkv, lag_bias] = pass.arguments;
        let (_, samples, width) = qkv.dims3()?;
        let out = (samples + 1 - self.0.window) * self.0.embedding;
        let (qkv, bias) = (values::<T>(qkv)?, values::<T>(lag_bias)?);
        let upstream = values::<T>(pass.gradient)?;
        let mut d_qkv = vec![T::default(); qkv.len()];
        let parts: Vec<Vec<T>> = d_qkv
            .par_chunks_mut(samples * width)
            .zip(qkv.par_chunks(samples * width))
            .zip(upstream.par_chunks(out))
            .map(|((d_qkv, qkv), gradient)| {
                let mut d_bias = vec![T::default(); bias.len()];
                self.row(qkv, &bias).backward(gradient, d_qkv, &mut d_bias);
                d_bias
            })
            .collect();
        let d_bias = sum_in_order(parts, bias.len());
        Ok([Some(d_qkv), Some(d_bias)])
    }
}
