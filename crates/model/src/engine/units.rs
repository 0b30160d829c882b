//! Conversion between features and forces in SI, as in the card, and the encoded, standardised numbers of the network.

use crate::{encoding::Encoder, force_model::ForceModel, normaliser::Normaliser};

/// Encoder and normaliser of a model.
#[derive(Clone, Debug)]
pub(super) struct Units {
    encoder: Encoder,
    pub(super) normaliser: Normaliser,
}

impl Units {
    pub(super) fn from_model(model: &ForceModel) -> Self {
        Self {
            encoder: model.encoder.clone(),
            normaliser: model.normaliser.clone(),
        }
    }

    /// Features a sample.
    pub(super) fn features(&self) -> usize {
        self.encoder.inputs()
    }

    /// n, numbers of an encoded sample.
    pub(super) fn encoded(&self) -> usize {
        self.encoder.len()
    }

    /// z [rows, n] of samples x [rows, features].
    pub(super) fn encode<T: From<f32>>(&self, x: &[f64], z: &mut [T]) {
        for (x, z) in x
            .chunks_exact(self.features())
            .zip(z.chunks_exact_mut(self.encoded()))
        {
            self.encoder
                .encode(x, |i, value| z[i] = self.normaliser.input(i, value).into());
        }
    }

    /// Forces [rows, f] in deviations.
    pub(super) fn standardise(&self, force: &[f64], into: &mut [f32]) {
        let outputs = self.normaliser.output_mean.len();
        for (index, (into, force)) in into.iter_mut().zip(force).enumerate() {
            *into = self.normaliser.force(index % outputs, *force);
        }
    }

    /// Forces [rows, f] from deviations.
    pub(super) fn to_si(&self, found: impl IntoIterator<Item = f32>, force: &mut [f64]) {
        let outputs = self.normaliser.output_mean.len();
        for (index, (force, found)) in force.iter_mut().zip(found).enumerate() {
            *force = self.normaliser.to_si(index % outputs, found);
        }
    }
}
