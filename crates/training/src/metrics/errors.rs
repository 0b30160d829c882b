//! Errors of predicted wrenches against the clean ones.

use hydro_model::normaliser::Moments;
use serde::{Deserialize, Serialize};

use crate::dataset::Split;

/// Errors of predicted wrenches against the clean ones, axis by axis and pooled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean absolute error of each axis [N, N m].
    pub mae: Vec<f64>,
    /// Root mean square error of each axis [N, N m].
    pub rmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench.
    pub nrmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench without its hydrostatic part.
    pub nrmse_hydrodynamic: Vec<f64>,
    /// Root mean square error against the perturbed wrench [N, N m].
    pub rmse_perturbed: Vec<f64>,
    /// Mean over axes of the absolute error in standard deviations of the clean wrench.
    pub pooled_mae: f64,
    /// Root mean square over axes of `nrmse`.
    pub pooled: f64,
    /// Root mean square over axes of `nrmse_hydrodynamic`.
    pub pooled_hydrodynamic: f64,
}

/// Running sums, axis by axis; trajectories are added as they are predicted.
#[derive(Clone, Debug)]
pub struct ErrorSums {
    count: f64,
    absolute: Vec<f64>,
    square: Vec<f64>,
    square_perturbed: Vec<f64>,
    clean: Moments,
    hydrodynamic: Moments,
}

impl ErrorSums {
    /// Empty sums for wrenches of `axes` components.
    pub fn new(axes: usize) -> Self {
        Self {
            count: 0.0,
            absolute: vec![0.0; axes],
            square: vec![0.0; axes],
            square_perturbed: vec![0.0; axes],
            clean: Moments::new(axes),
            hydrodynamic: Moments::new(axes),
        }
    }

    /// Adds a predicted trajectory [T, f], all samples but the first, which is given.
    pub fn add_trajectory(&mut self, predicted: &[f64], split: &Split, trajectory: usize) {
        let f = split.outputs();
        let [clean, hydrostatic, perturbed] = [
            split.clean(trajectory),
            split.hydrostatic(trajectory),
            split.wrench(trajectory),
        ];
        for k in 1..split.samples() {
            let row = |values: &[f32]| -> Vec<f64> {
                let row = &values[k * f..][..f];
                row.iter().map(|value| f64::from(*value)).collect()
            };
            self.add(
                &predicted[k * f..][..f],
                &row(clean),
                &row(hydrostatic),
                &row(perturbed),
            );
        }
    }

    fn add(&mut self, predicted: &[f64], clean: &[f64], hydrostatic: &[f64], perturbed: &[f64]) {
        self.count += 1.0;
        for (axis, value) in predicted.iter().enumerate() {
            let error = value - clean[axis];
            self.absolute[axis] += error.abs();
            self.square[axis] += error * error;
            self.square_perturbed[axis] += (value - perturbed[axis]).powi(2);
        }
        self.clean.add(clean);
        let hydrodynamic: Vec<f64> = clean
            .iter()
            .zip(hydrostatic)
            .map(|(all, part)| all - part)
            .collect();
        self.hydrodynamic.add(&hydrodynamic);
    }

    /// The errors of everything added.
    pub fn errors(&self) -> Errors {
        let mean = |sums: &[f64]| -> Vec<f64> { sums.iter().map(|sum| sum / self.count).collect() };
        let root = |sums: &[f64]| -> Vec<f64> { mean(sums).into_iter().map(f64::sqrt).collect() };
        let over = |errors: &[f64], scale: &[f64]| -> Vec<f64> {
            errors
                .iter()
                .zip(scale)
                .map(|(error, scale)| error / scale)
                .collect()
        };
        let pool = |values: &[f64]| {
            (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
        };
        let (mae, rmse) = (mean(&self.absolute), root(&self.square));
        let scale = self.clean.std();
        let nrmse = over(&rmse, &scale);
        let nrmse_hydrodynamic = over(&rmse, &self.hydrodynamic.std());
        Errors {
            pooled_mae: over(&mae, &scale).iter().sum::<f64>() / mae.len() as f64,
            pooled: pool(&nrmse),
            pooled_hydrodynamic: pool(&nrmse_hydrodynamic),
            rmse_perturbed: root(&self.square_perturbed),
            mae,
            rmse,
            nrmse,
            nrmse_hydrodynamic,
        }
    }
}

#[cfg(test)]
#[path = "tests/errors.rs"]
mod tests;
