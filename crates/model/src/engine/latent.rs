//! The latent h that drives the differential equation of a force, from the memory of past samples.

use pulp::Arch;

use super::{
    attention_cache::AttentionCache, feature_latent::FeatureLatent,
    packed_perceptron::PackedPerceptron,
};

/// h of a memory `[slot of the newest sample, samples ..]`.
#[derive(Clone, Debug)]
pub(super) enum Latent {
    /// Attention over the samples of the window.
    Attention(AttentionCache),
    /// Attention over the numbers of the window.
    Features(FeatureLatent),
    /// A perceptron of the one sample that the memory holds.
    Perceptron(PackedPerceptron),
}

impl Latent {
    /// W.
    pub(super) fn window(&self) -> usize {
        match self {
            Self::Attention(past) => past.window(),
            Self::Features(features) => features.window(),
            Self::Perceptron(_) => 1,
        }
    }

    /// l.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Attention(past) => past.latent_len(),
            Self::Features(features) => features.latent_len(),
            Self::Perceptron(perceptron) => perceptron.config.outputs,
        }
    }

    /// Numbers of scratch that [`Latent::evaluate`] takes.
    pub(super) fn scratch(&self) -> usize {
        match self {
            Self::Attention(past) => past.scratch(),
            Self::Features(features) => features.scratch(),
            Self::Perceptron(perceptron) => perceptron.config.inputs + perceptron.scratch(),
        }
    }

    /// h [l].
    pub(super) fn evaluate(
        &self,
        arch: Arch,
        memory: &[f64],
        latent: &mut [f32],
        scratch: &mut [f32],
    ) {
        match self {
            Self::Attention(past) => past.latent(arch, memory, latent, scratch),
            Self::Features(features) => features.latent(arch, memory, latent, scratch),
            Self::Perceptron(perceptron) => {
                let (input, layers) = scratch.split_at_mut(perceptron.config.inputs);
                for (slot, z) in input.iter_mut().zip(&memory[1..]) {
                    *slot = *z as f32;
                }
                perceptron.evaluate(arch, input, latent, layers);
            }
        }
    }
}
