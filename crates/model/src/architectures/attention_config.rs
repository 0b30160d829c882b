//! Sizes of an Attention-ODE, and what its attention attends to.

use serde::{Deserialize, Serialize};

use super::bounds::MOST_TOKENS;
use crate::{
    encoding::{Encoder, Encoding},
    features::FeatureLayout,
    operations::attention::slope,
};

/// Tokens of the attention.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tokens {
    /// The samples of the window: the newest attends to the past (`sample_attention.rs`).
    #[default]
    Samples,
    /// The encoded numbers of the window, each a token: the condition vector is compressed, as the paper says it
    /// (`feature_attention.rs`).
    Features,
}

/// Sizes of an Attention-ODE.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AttentionOdeConfig {
    /// W, samples of the past that h sees, the newest included.
    pub window: usize,
    /// Attention heads.
    pub heads: usize,
    /// E, length of a sample's embedding; the heads divide it.
    pub embedding: usize,
    /// Length of h; the paper's is the length of the force.
    pub latent: usize,
    /// Hidden layers of the field.
    pub hidden: Vec<usize>,
    /// Encoding of a sample.
    pub encoding: Encoding,
    /// True if the field reads F besides h; if not, the force is a running sum (the paper writes both).
    pub field_sees_force: bool,
    /// True if the field has a linear part A [F; h], initialised to -F plus small numbers.
    pub skip: bool,
    /// Tokens of the attention; samples in a card without it.
    #[serde(skip_serializing_if = "is_default")]
    pub tokens: Tokens,
    /// True if the sample at its end drives a step, F_{k+1} = F_k + dt f(F_k, h_{k+1}); false if the sample at its start
    /// does, which delays the force by a sample. A card without it says false.
    #[serde(skip_serializing_if = "is_default")]
    pub end_of_step: bool,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Default for AttentionOdeConfig {
    fn default() -> Self {
        Self {
            window: 8,
            heads: 4,
            embedding: 64,
            latent: 64,
            hidden: vec![512; 3],
            encoding: Encoding::Up,
            field_sees_force: true,
            skip: true,
            tokens: Tokens::Samples,
            end_of_step: false,
        }
    }
}

impl AttentionOdeConfig {
    /// Fixed slope of a head, taken off the score of a past sample for each sample of lag: 4^(1-head).
    pub fn slope(head: usize) -> f64 {
        slope(head)
    }

    /// Reason why a model of these sizes cannot be built, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        let sizes = [self.window, self.heads, self.embedding, self.latent];
        if sizes.contains(&0) || self.hidden.contains(&0) {
            return Some(
                "window, heads, embedding, latent and hidden sizes must be at least 1".to_owned(),
            );
        }
        (!self.embedding.is_multiple_of(self.heads)).then(|| {
            format!(
                "embedding {} is not divisible by {} heads",
                self.embedding, self.heads
            )
        })
    }

    /// Reason why the numbers of a window cannot all be tokens, if they are to be.
    pub(super) fn too_many_tokens(&self, layout: &FeatureLayout) -> Option<String> {
        let numbers = Encoder::new(&self.encoding, layout).len();
        let count = self.window.saturating_mul(numbers);
        (self.tokens == Tokens::Features && count > MOST_TOKENS).then(|| {
            format!(
                "attention over features has {count} tokens ({} samples of {numbers} encoded numbers), expected {MOST_TOKENS} \
                 at most: choose encoding raw or up, or a smaller window",
                self.window
            )
        })
    }
}
