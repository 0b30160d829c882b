//! The latent by attention over time: the newest sample attends to the samples of a window.
//!
//! ```text
//! e_k = W_e z_k + b_e                                           embedding of the encoded, standardised sample
//! h_k = W_h (e_k + W_o attention(e_{k-W+1} .. e_k) + b_o) + b_h
//! ```

use candle_core::{Result, Tensor};
use candle_nn::VarBuilder;

use super::{
    attention::Attention,
    attention_config::AttentionOdeConfig,
    linear::{affine, linear},
};
use crate::operations::{Backend, attention::AttentionConfig};

/// The layers in Candle.
#[derive(Clone, Debug)]
pub(crate) struct SampleAttention {
    window: usize,
    /// W_e [E, n], b_e [E].
    pub(crate) embed: (Tensor, Tensor),
    pub(crate) attention: Attention,
    /// W_o [E, E], b_o [E].
    pub(crate) mix: (Tensor, Tensor),
    /// W_h [l, E], b_h [l].
    pub(crate) latent: (Tensor, Tensor),
}

impl SampleAttention {
    /// Weights `embed.*`, `attention.*`, `mix.*`, `latent.*` for `inputs` encoded numbers a sample.
    pub(super) fn new(config: &AttentionOdeConfig, inputs: usize, vb: &VarBuilder) -> Result<Self> {
        let attention = AttentionConfig {
            embedding: config.embedding,
            heads: config.heads,
            window: config.window,
        };
        let width = config.embedding;
        Ok(Self {
            window: config.window,
            embed: linear(vb, "embed", inputs, width, 1.0)?,
            attention: Attention::new(attention, vb.pp("attention"))?,
            mix: linear(vb, "mix", width, width, 1.0)?,
            latent: linear(vb, "latent", width, config.latent, 1.0)?,
        })
    }

    /// z [B, W-1+S, n] -> h [B, S, l].
    pub(super) fn latents(&self, operations: Backend, z: &Tensor) -> Result<Tensor> {
        let embeddings = self.embeddings(z)?;
        let (batch, samples, width) = embeddings.dims3()?;
        let attended = self.attention.forward(&embeddings, operations)?;
        let steps = samples + 1 - self.window;
        let newest = embeddings
            .narrow(1, self.window - 1, steps)?
            .contiguous()?
            .reshape((batch * steps, width))?;
        let attended = attended.reshape((batch * steps, width))?;
        let mixed = (newest + affine(&attended, &self.mix)?)?;
        affine(&mixed, &self.latent)?.reshape((batch, steps, ()))
    }

    /// Weight of each lag, newest first, [B S, H, W], of z [B, W-1+S, n].
    pub(super) fn weights(&self, z: &Tensor) -> Result<Tensor> {
        self.attention.weights(&self.embeddings(z)?)
    }

    /// h [1, l] of one window z [W, n], by Candle's own operations and without threads.
    pub(super) fn single(&self, z: &Tensor) -> Result<Tensor> {
        let embeddings = affine(z, &self.embed)?;
        let newest = embeddings.narrow(0, self.window - 1, 1)?;
        let mixed = (newest + affine(&self.attention.single(&embeddings)?, &self.mix)?)?;
        affine(&mixed, &self.latent)
    }

    fn embeddings(&self, z: &Tensor) -> Result<Tensor> {
        let (batch, samples, inputs) = z.dims3()?;
        let rows = affine(&z.reshape((batch * samples, inputs))?, &self.embed)?;
        rows.reshape((batch, samples, ()))
    }
}
