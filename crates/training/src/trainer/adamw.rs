//! AdamW whose moments can be read, so that a run can be resumed exactly.
//!
//! It runs on the processor wherever the weights are: once a step the gradient is fetched and the weights are written
//! back. That is little beside a pass through the solver, and keeps the moments the same on all devices.
//!
//! I. Loshchilov, F. Hutter, "Decoupled Weight Decay Regularization", arXiv:1711.05101.

use std::collections::BTreeMap;

use candle_core::{Result, Tensor, backprop::GradStore};
use hydro_model::Parameters;

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.99;
const EPSILON: f32 = 1e-8;

/// First and second moments of the gradient, by weight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdamW {
    /// Steps taken.
    pub(super) step: usize,
    pub(super) moments: BTreeMap<String, (Vec<f32>, Vec<f32>)>,
}

/// Settings of one step.
#[derive(Clone, Copy, Debug)]
pub struct StepSettings {
    /// Length of a step where the gradient keeps its sign.
    pub learning_rate: f64,
    /// Share by which matrices shrink a step, per unit of learning rate.
    pub weight_decay: f64,
    /// Largest norm of the gradient over all weights.
    pub clip_norm: f64,
}

impl AdamW {
    /// Moves the weights one step down the gradient; returns the gradient's norm before clipping.
    pub fn step(
        &mut self,
        parameters: &Parameters,
        gradients: &GradStore,
        step: StepSettings,
    ) -> Result<f64> {
        let found = parameters
            .iter()
            .map(|(_, var)| {
                gradients
                    .get(var)
                    .map(|g| g.flatten_all()?.to_vec1::<f32>())
                    .transpose()
            })
            .collect::<Result<Vec<Option<Vec<f32>>>>>()?;
        let square: f64 = found
            .iter()
            .flatten()
            .flatten()
            .map(|g| f64::from(*g) * f64::from(*g))
            .sum();
        let norm = square.sqrt();
        let scale = if norm > step.clip_norm {
            (step.clip_norm / norm) as f32
        } else {
            1.0
        };

        self.step += 1;
        let correction = |beta: f32| 1.0 - f64::from(beta).powi(self.step as i32);
        let (first, second) = (correction(BETA_1) as f32, correction(BETA_2) as f32);
        for ((name, var), gradient) in parameters.iter().zip(found) {
            let Some(gradient) = gradient else { continue };
            // Biases are not decayed.
            let decay = if var.rank() > 1 {
                step.learning_rate * step.weight_decay
            } else {
                0.0
            };
            let keep = (1.0 - decay) as f32;
            let mut values = var.flatten_all()?.to_vec1::<f32>()?;
            let (mean, square) = self
                .moments
                .entry(name.to_owned())
                .or_insert_with(|| (vec![0.0; values.len()], vec![0.0; values.len()]));
            for (((value, gradient), mean), square) in values
                .iter_mut()
                .zip(gradient)
                .zip(mean.iter_mut())
                .zip(square.iter_mut())
            {
                let gradient = gradient * scale;
                *mean = BETA_1 * *mean + (1.0 - BETA_1) * gradient;
                *square = BETA_2 * *square + (1.0 - BETA_2) * gradient * gradient;
                let change = (*mean / first) / ((*square / second).sqrt() + EPSILON);
                *value = keep * *value - step.learning_rate as f32 * change;
            }
            var.set(&Tensor::from_vec(values, var.shape(), var.device())?)?;
        }
        Ok(norm)
    }
}

#[cfg(test)]
#[path = "tests/adamw.rs"]
mod tests;
