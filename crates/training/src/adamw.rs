//! AdamW with its moments in the open, so that a run can be resumed exactly.
//!
//! It runs on the processor wherever the weights are: the gradient comes over once a step and the weights go back,
//! which is little beside a pass through the solver, and keeps the moments the same to all devices.
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
pub struct Step {
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
        step: Step,
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
mod tests {
    use candle_nn::{Init, VarBuilder};

    use super::*;

    /// One step from w = [2] (a vector: no decay) with gradient g moves by the learning rate, whatever g's size:
    /// mean/first = g, square/second = g^2 on the first step.
    #[test]
    fn the_first_step_has_the_length_of_the_learning_rate() {
        let build = |vb: VarBuilder| vb.get_with_hints(1, "w", Init::Const(2.0));
        let (_, parameters) = Parameters::draw(0, build).expect("drawn");
        let (_, var) = parameters.iter().next().expect("one weight");
        let loss = (var.as_tensor() * 1000.0)
            .and_then(|t| t.sum_all())
            .expect("a loss");
        let gradients = loss.backward().expect("derives");
        let step = Step {
            learning_rate: 0.1,
            weight_decay: 0.5,
            clip_norm: 1.0,
        };
        let norm = AdamW::default()
            .step(&parameters, &gradients, step)
            .expect("steps");
        assert!((norm - 1000.0).abs() < 1e-6);
        let moved = var.to_vec1::<f32>().expect("a number")[0];
        assert!((moved - 1.9).abs() < 1e-6, "{moved}");
    }
}
