//! Causal multi-head attention of the newest sample over a window of past samples.
//!
//! With e_l the embedding of the sample `l` steps back, head by head:
//!
//! ```text
//! score_l = q . k_l / sqrt(d) - slope l + bias_l     q = W_q e_0, k_l = W_k e_l, v_l = W_v e_l
//! out     = sum_l softmax(score)_l v_l               l = 0 .. W-1
//! ```
//!
//! Keys and values belong to a sample, not to a window, so neighbouring windows share them. `slope` is fixed,
//! 4^(1-head): the first head starts out with the newest sample, the others look further back (after
//! O. Press, N. Smith, M. Lewis, "Train Short, Test Long", arXiv:2108.12409); `bias` is learned.

use candle_core::{CpuStorage, CustomOp2, D, DType, Layout, Result, Shape, Tensor};
use candle_nn::{Init, VarBuilder};
use rayon::prelude::*;

use super::{
    kernel::{Real, dot, sum_in_order},
    operations::Operations,
    typed::{in_either_precision, numbers},
};

/// Sizes of an attention layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttentionConfig {
    /// E, length of an embedding.
    pub embedding: usize,
    /// H, dividing E.
    pub heads: usize,
    /// W, samples seen, the newest included.
    pub window: usize,
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

/// The layer in Candle.
#[derive(Clone, Debug)]
pub struct Attention {
    config: AttentionConfig,
    /// W_q, W_k, W_v one above the other, [3 E, E].
    pub(crate) weight: Tensor,
    /// [3 E].
    pub(crate) bias: Tensor,
    /// Learned bias by lag [H, W].
    pub(crate) lag_bias: Tensor,
}

/// Fixed slope of a head.
pub(crate) fn slope(head: usize) -> f64 {
    4f64.powi(1 - head as i32)
}

impl Attention {
    /// Weights `qkv.weight`, `qkv.bias`, `lag_bias`.
    pub fn new(config: AttentionConfig, vb: VarBuilder) -> Result<Self> {
        let width = config.embedding;
        let up = 1.0 / (width as f64).sqrt();
        let qkv = vb.pp("qkv");
        Ok(Self {
            weight: qkv.get_with_hints(
                (3 * width, width),
                "weight",
                Init::Uniform { lo: -up, up },
            )?,
            bias: qkv.get_with_hints(3 * width, "bias", Init::Const(0.0))?,
            lag_bias: vb.get_with_hints(
                (config.heads, config.window),
                "lag_bias",
                Init::Const(0.0),
            )?,
            config,
        })
    }

    /// Embeddings [B, W-1+S, E] -> attended values [B, S, E], for training.
    pub(crate) fn forward(&self, embeddings: &Tensor, operations: Operations) -> Result<Tensor> {
        let qkv = self.projected(embeddings)?;
        match operations {
            Operations::Kernels => qkv.apply_op2(&self.lag_bias, Window(self.config.clone())),
            Operations::Tensors => self.window_by_tensors(&qkv),
        }
    }

    /// q, k and v of embeddings [B, T, E], side by side [B, T, 3 E].
    fn projected(&self, embeddings: &Tensor) -> Result<Tensor> {
        let (batch, samples, width) = embeddings.dims3()?;
        let rows = embeddings.reshape((batch * samples, width))?;
        let qkv = rows.matmul(&self.weight.t()?)?.broadcast_add(&self.bias)?;
        qkv.reshape((batch, samples, 3 * width))
    }

    /// What [`Window`] does, lag by lag for all samples at once.
    fn window_by_tensors(&self, qkv: &Tensor) -> Result<Tensor> {
        let weights = self.weights_by_tensors(qkv)?;
        let values = self.part(qkv, 2)?;
        let mut attended = self
            .lagged(&values, 0)?
            .broadcast_mul(&weights.narrow(3, 0, 1)?)?;
        for lag in 1..self.config.window {
            let value = self
                .lagged(&values, lag)?
                .broadcast_mul(&weights.narrow(3, lag, 1)?)?;
            attended = (attended + value)?;
        }
        let (batch, steps, ..) = attended.dims4()?;
        attended.reshape((batch, steps, self.config.embedding))
    }

    /// Queries (0), keys (1) or values (2) of all samples, [B, W-1+S, H, d].
    fn part(&self, qkv: &Tensor, index: usize) -> Result<Tensor> {
        let AttentionConfig {
            embedding, heads, ..
        } = self.config;
        let (batch, samples, _) = qkv.dims3()?;
        let part = qkv.narrow(2, index * embedding, embedding)?.contiguous()?;
        part.reshape((batch, samples, heads, embedding / heads))
    }

    /// Of all samples [B, W-1+S, ..] those that stand `lag` before a newest one, [B, S, ..].
    fn lagged(&self, all: &Tensor, lag: usize) -> Result<Tensor> {
        let window = self.config.window;
        all.narrow(1, window - 1 - lag, all.dim(1)? + 1 - window)
    }

    /// Softmax weights by lag, [B, S, H, W].
    fn weights_by_tensors(&self, qkv: &Tensor) -> Result<Tensor> {
        let AttentionConfig {
            embedding,
            heads,
            window,
        } = self.config;
        let (queries, keys) = (self.part(qkv, 0)?, self.part(qkv, 1)?);
        let queries = self.lagged(&queries, 0)?;
        let scores = (0..window)
            .map(|lag| (&queries * self.lagged(&keys, lag)?)?.sum(D::Minus1))
            .collect::<Result<Vec<_>>>()?;
        let scores = (Tensor::stack(&scores, 3)? / ((embedding / heads) as f64).sqrt())?;
        let fixed: Vec<f64> = (0..heads)
            .flat_map(|head| (0..window).map(move |lag| slope(head) * lag as f64))
            .collect();
        let fixed = Tensor::from_vec(fixed, (heads, window), qkv.device())?;
        let bias = (&self.lag_bias - fixed.to_dtype(qkv.dtype())?)?;
        let scores = scores.broadcast_add(&bias)?;

        // The largest score only guards the exponential: no gradient goes through it.
        let largest = scores.detach().max_keepdim(D::Minus1)?;
        let powers = scores.broadcast_sub(&largest)?.exp()?;
        powers.broadcast_div(&powers.sum_keepdim(D::Minus1)?)
    }

    /// Mean weight of each lag, newest first, `[H][W]`, over all samples of embeddings [B, W-1+S, E].
    pub(crate) fn mean_weights(&self, embeddings: &Tensor) -> Result<Vec<Vec<f64>>> {
        self.weights_by_tensors(&self.projected(embeddings)?)?
            .mean((0, 1))?
            .to_dtype(DType::F64)?
            .to_vec2()
    }

    /// One window of embeddings [W, E] -> [1, E], by Candle's own operations and without threads.
    pub fn single(&self, embeddings: &Tensor) -> Result<Tensor> {
        let AttentionConfig {
            embedding,
            heads,
            window,
        } = self.config;
        let depth = embedding / heads;
        let qkv = embeddings
            .matmul(&self.weight.t()?)?
            .broadcast_add(&self.bias)?;
        let split = |part: usize| {
            let part = qkv
                .narrow(1, part * embedding, embedding)?
                .reshape((window, heads, depth))?;
            part.transpose(0, 1)?.contiguous()
        };
        // [H, 1, d], [H, W, d], [H, W, d]
        let (q, k, v) = (
            split(0)?.narrow(1, window - 1, 1)?.contiguous()?,
            split(1)?,
            split(2)?,
        );
        let scores = (q.matmul(&k.t()?)? / (depth as f64).sqrt())?;
        // Lag 0 is the newest sample, the last row of the window.
        let lags: Vec<u32> = (0..window as u32).rev().collect();
        let lags = Tensor::new(lags, embeddings.device())?;
        let fixed: Vec<f32> = (0..heads)
            .flat_map(|head| {
                (0..window)
                    .rev()
                    .map(move |lag| -(slope(head) * lag as f64) as f32)
            })
            .collect();
        let fixed = Tensor::from_vec(fixed, (heads, window), embeddings.device())?;
        let bias = (self.lag_bias.index_select(&lags, 1)? + fixed)?.unsqueeze(1)?;
        let scores = (scores + bias)?;
        let powers = scores
            .broadcast_sub(&scores.max_keepdim(D::Minus1)?)?
            .exp()?;
        let weights = powers.broadcast_div(&powers.sum_keepdim(D::Minus1)?)?;
        weights.matmul(&v)?.reshape((1, embedding))
    }
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
        let largest = weights
            .iter()
            .copied()
            .fold(weights[0], |a, b| if b > a { b } else { a });
        let mut sum = T::default();
        for weight in weights.iter_mut() {
            *weight = (*weight - largest).exponential();
            sum += *weight;
        }
        for weight in weights {
            *weight /= sum;
        }
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

    fn run<T: Real>(&self, qkv: &[T], lag_bias: &[T], (batch, samples): (usize, usize)) -> Vec<T> {
        let out = samples + 1 - self.0.window;
        let mut values = vec![T::default(); batch * out * self.0.embedding];
        values
            .par_chunks_mut(out * self.0.embedding)
            .zip(qkv.par_chunks(samples * 3 * self.0.embedding))
            .for_each(|(out, qkv)| self.row(qkv, lag_bias).forward(out));
        values
    }

    fn backward<T: Real>(
        &self,
        qkv: &Tensor,
        lag_bias: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Tensor, Tensor)> {
        let (_, samples, width) = qkv.dims3()?;
        let out = (samples + 1 - self.0.window) * self.0.embedding;
        let values = qkv.flatten_all()?.to_vec1::<T>()?;
        let bias = lag_bias.flatten_all()?.to_vec1::<T>()?;
        let upstream = gradient.flatten_all()?.to_vec1::<T>()?;
        let mut d_qkv = vec![T::default(); values.len()];
        let parts: Vec<Vec<T>> = d_qkv
            .par_chunks_mut(samples * width)
            .zip(values.par_chunks(samples * width))
            .zip(upstream.par_chunks(out))
            .map(|((d_qkv, qkv), gradient)| {
                let mut d_bias = vec![T::default(); bias.len()];
                self.row(qkv, &bias).backward(gradient, d_qkv, &mut d_bias);
                d_bias
            })
            .collect();
        let d_bias = sum_in_order(parts, bias.len());
        Ok((
            Tensor::from_vec(d_qkv, qkv.shape(), qkv.device())?,
            Tensor::from_vec(d_bias, lag_bias.shape(), qkv.device())?,
        ))
    }
}

impl CustomOp2 for Window {
    fn name(&self) -> &'static str {
        "window-attention"
    }

    fn cpu_fwd(
        &self,
        s1: &CpuStorage,
        l1: &Layout,
        s2: &CpuStorage,
        l2: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (batch, samples, _) = l1.shape().dims3()?;
        let shape = Shape::from((batch, samples + 1 - self.0.window, self.0.embedding));
        let size = (batch, samples);
        let storage =
            in_either_precision!(self, s1, self.run(numbers(s1, l1)?, numbers(s2, l2)?, size));
        Ok((storage, shape))
    }

    fn bwd(
        &self,
        qkv: &Tensor,
        lag_bias: &Tensor,
        _: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let (d_qkv, d_bias) = match qkv.dtype() {
            candle_core::DType::F64 => self.backward::<f64>(qkv, lag_bias, gradient)?,
            _ => self.backward::<f32>(qkv, lag_bias, gradient)?,
        };
        Ok((Some(d_qkv), Some(d_bias)))
    }
}

#[cfg(test)]
mod tests {
    use candle_core::{Device, Var};

    use super::*;
    use crate::testing::ramp;

    #[test]
    fn tensor_operations_give_what_the_kernel_gives() {
        for (heads, window, samples) in [(2, 3, 12), (4, 1, 5), (1, 5, 5)] {
            let config = AttentionConfig {
                embedding: 8,
                heads,
                window,
            };
            let embeddings = Var::from_tensor(&ramp(&[3, samples, 8], 0.53)).expect("a variable");
            let [weight, bias, lag_bias] =
                [(&[24, 8][..], 0.37), (&[24], 0.71), (&[heads, window], 1.3)].map(
                    |(shape, step)| {
                        let values = (ramp(shape, step) * 0.4).expect("scaled");
                        Var::from_tensor(&values).expect("a variable")
                    },
                );
            let attention = Attention {
                config,
                weight: weight.as_tensor().clone(),
                bias: bias.as_tensor().clone(),
                lag_bias: lag_bias.as_tensor().clone(),
            };
            let run = |operations| {
                let out = attention.forward(&embeddings, operations).expect("runs");
                let loss =
                    (out.sqr().expect("squares") * ramp(out.dims(), 0.31)).expect("weighted");
                let gradients = loss.sum_all().and_then(|loss| loss.backward());
                (out, gradients.expect("derives"))
            };
            let (kernel, theirs) = run(Operations::Kernels);
            let (tensors, ours) = run(Operations::Tensors);
            let close = |name: &str, ours: &Tensor, theirs: &Tensor| {
                assert_eq!(ours.dims(), theirs.dims());
                let largest = |tensor: Result<Tensor>| {
                    tensor
                        .and_then(|t| t.abs()?.flatten_all()?.max(0)?.to_scalar::<f64>())
                        .expect("a number")
                };
                let (error, scale) = (largest(ours - theirs), largest(Ok(theirs.clone())));
                assert!(
                    error <= 1e-11 * scale.max(1e-3),
                    "{name}, {window}: {error} of {scale}"
                );
            };
            close("value", &tensors, &kernel);
            for (name, var) in [
                ("embeddings", &embeddings),
                ("weight", &weight),
                ("bias", &bias),
                ("lag bias", &lag_bias),
            ] {
                close(
                    name,
                    ours.get(var).expect(name),
                    theirs.get(var).expect(name),
                );
            }
        }
    }

    #[test]
    fn large_scores_do_not_overflow_in_tensor_operations() {
        let config = AttentionConfig {
            embedding: 4,
            heads: 1,
            window: 3,
        };
        let attention = Attention {
            weight: (ramp(&[12, 4], 0.37) * 1e3).expect("scaled"),
            bias: Tensor::zeros(12, DType::F64, &Device::Cpu).expect("zeros"),
            lag_bias: Tensor::zeros((1, 3), DType::F64, &Device::Cpu).expect("zeros"),
            config,
        };
        let out = attention.forward(&ramp(&[2, 6, 4], 0.53), Operations::Tensors);
        let values = out
            .and_then(|t| t.flatten_all()?.to_vec1::<f64>())
            .expect("runs");
        assert!(values.iter().all(|value| value.is_finite()), "{values:?}");
    }
}
