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

use candle_core::{D, Result, Tensor};
use candle_nn::{Init, VarBuilder};

use crate::operations::{
    Backend,
    attention::{AttentionConfig, attend, slope, softmax_weights},
};

/// The layer in Candle.
#[derive(Clone, Debug)]
pub(crate) struct Attention {
    config: AttentionConfig,
    /// W_q, W_k, W_v one above the other, [3 E, E].
    pub(crate) weight: Tensor,
    /// [3 E].
    pub(crate) bias: Tensor,
    /// Learned bias by lag [H, W].
    pub(crate) lag_bias: Tensor,
}

impl Attention {
    /// Weights `qkv.weight`, `qkv.bias`, `lag_bias`.
    pub(crate) fn new(config: AttentionConfig, vb: VarBuilder) -> Result<Self> {
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
    pub(crate) fn forward(&self, embeddings: &Tensor, backend: Backend) -> Result<Tensor> {
        attend(
            backend,
            &self.config,
            &self.projected(embeddings)?,
            &self.lag_bias,
        )
    }

    /// q, k and v of embeddings [B, T, E], side by side [B, T, 3 E].
    fn projected(&self, embeddings: &Tensor) -> Result<Tensor> {
        let (batch, samples, width) = embeddings.dims3()?;
        let rows = embeddings.reshape((batch * samples, width))?;
        let qkv = rows.matmul(&self.weight.t()?)?.broadcast_add(&self.bias)?;
        qkv.reshape((batch, samples, 3 * width))
    }

    /// Weight of each lag, newest first, [B S, H, W], of embeddings [B, W-1+S, E].
    pub(crate) fn weights(&self, embeddings: &Tensor) -> Result<Tensor> {
        softmax_weights(&self.config, &self.projected(embeddings)?, &self.lag_bias)?.flatten(0, 1)
    }

    /// One window of embeddings [W, E] -> [1, E], by Candle's own operations and without threads.
    pub(crate) fn single(&self, embeddings: &Tensor) -> Result<Tensor> {
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

#[cfg(test)]
mod tests {
    use candle_core::{DType, Device, Var};

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
            let run = |backend| {
                let out = attention.forward(&embeddings, backend).expect("runs");
                let loss =
                    (out.sqr().expect("squares") * ramp(out.dims(), 0.31)).expect("weighted");
                let gradients = loss.sum_all().and_then(|loss| loss.backward());
                (out, gradients.expect("derives"))
            };
            let (kernel, theirs) = run(Backend::Kernels);
            let (tensors, ours) = run(Backend::Tensors);
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
        let out = attention.forward(&ramp(&[2, 6, 4], 0.53), Backend::Tensors);
        let values = out
            .and_then(|t| t.flatten_all()?.to_vec1::<f64>())
            .expect("runs");
        assert!(values.iter().all(|value| value.is_finite()), "{values:?}");
    }
}
