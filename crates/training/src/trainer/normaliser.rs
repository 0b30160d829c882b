//! Means and standard deviations of the training split.

use hydro_model::{Encoder, Normaliser, normaliser::Moments};

use super::config::Labels;
use crate::dataset::Split;

/// Means and deviations over a split.
pub(super) fn training_normaliser(split: &Split, encoder: &Encoder, labels: Labels) -> Normaliser {
    let (mut inputs, mut outputs) = (Moments::new(encoder.len()), Moments::new(split.outputs()));
    let mut z = vec![0.0; encoder.len()];
    for trajectory in 0..split.len() {
        for row in split.x(trajectory).chunks_exact(split.inputs()) {
            let row: Vec<f64> = row.iter().map(|value| f64::from(*value)).collect();
            encoder.encode(&row, |i, value| z[i] = value);
            inputs.add(&z);
        }
        let wrench = match labels {
            Labels::Perturbed => split.wrench(trajectory),
            Labels::Clean => split.clean(trajectory),
        };
        for row in wrench.chunks_exact(split.outputs()) {
            let row: Vec<f64> = row.iter().map(|value| f64::from(*value)).collect();
            outputs.add(&row);
        }
    }
    Normaliser {
        input_mean: inputs.mean(),
        input_std: inputs.std(),
        output_mean: outputs.mean(),
        output_std: outputs.std(),
    }
}
