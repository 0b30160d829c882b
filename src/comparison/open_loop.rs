//! Open loop: wrenches predicted from recorded features, beside the true ones.

use serde::{Deserialize, Serialize};

/// Errors of one contender on a test split, against the clean wrench.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OpenLoopRow {
    /// Name in the table.
    pub name: String,
    /// Mean absolute error of each axis [N, N m].
    pub mae: Vec<f64>,
    /// Root mean square error of each axis [N, N m].
    pub rmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench.
    pub nrmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench without its hydrostatic part.
    pub nrmse_hydrodynamic: Vec<f64>,
    /// Root mean square over axes of `nrmse`.
    pub pooled: f64,
    /// Root mean square over axes of `nrmse_hydrodynamic`.
    pub pooled_hydrodynamic: f64,
}

/// Wrenches along one test trajectory, for plots.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Example {
    /// Sample times [s].
    pub time: Vec<f64>,
    /// Name, and one row a sample of the wrench [N, N m]; the truth first.
    pub wrenches: Vec<(String, Vec<Vec<f64>>)>,
}

/// The open-loop comparison.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OpenLoop {
    /// Names of the axes, `force.x` and so on.
    pub outputs: Vec<String>,
    /// How many test trajectories.
    pub trajectories: usize,
    /// One row a contender.
    pub rows: Vec<OpenLoopRow>,
    /// One trajectory in full.
    pub example: Example,
}

/// Sums of errors and of the truth's moments, axis by axis; predictions are added as they come.
#[derive(Clone, Debug)]
pub struct Accumulator {
    axes: usize,
    count: f64,
    absolute: Vec<f64>,
    square: Vec<f64>,
    clean: Moments,
    hydrodynamic: Moments,
}

/// Running mean and sum of squared deviations (Welford), axis by axis.
#[derive(Clone, Debug)]
struct Moments {
    count: f64,
    mean: Vec<f64>,
    deviation: Vec<f64>,
}

impl Moments {
    fn new(axes: usize) -> Self {
        Self {
            count: 0.0,
            mean: vec![0.0; axes],
            deviation: vec![0.0; axes],
        }
    }

    fn add(&mut self, row: impl Iterator<Item = f64>) {
        self.count += 1.0;
        for (axis, value) in row.enumerate() {
            let from_old_mean = value - self.mean[axis];
            self.mean[axis] += from_old_mean / self.count;
            self.deviation[axis] += from_old_mean * (value - self.mean[axis]);
        }
    }

    fn standard_deviations(&self) -> Vec<f64> {
        let variance = |sum: &f64| (sum / self.count).sqrt();
        self.deviation.iter().map(variance).collect()
    }
}

impl Accumulator {
    /// For wrenches of `axes` components.
    pub fn new(axes: usize) -> Self {
        Self {
            axes,
            count: 0.0,
            absolute: vec![0.0; axes],
            square: vec![0.0; axes],
            clean: Moments::new(axes),
            hydrodynamic: Moments::new(axes),
        }
    }

    /// Adds one sample: predicted, clean and hydrostatic wrench.
    pub fn add(&mut self, predicted: &[f64], clean: &[f64], hydrostatic: &[f64]) {
        self.count += 1.0;
        for axis in 0..self.axes {
            let error = predicted[axis] - clean[axis];
            self.absolute[axis] += error.abs();
            self.square[axis] += error * error;
        }
        self.clean.add(clean.iter().copied());
        self.hydrodynamic
            .add(clean.iter().zip(hydrostatic).map(|(all, part)| all - part));
    }

    /// The errors of everything added.
    pub fn row(&self, name: &str) -> OpenLoopRow {
        let mean = |sums: &[f64]| -> Vec<f64> { sums.iter().map(|sum| sum / self.count).collect() };
        let rmse: Vec<f64> = mean(&self.square).iter().map(|v| v.sqrt()).collect();
        let over =
            |scale: Vec<f64>| -> Vec<f64> { rmse.iter().zip(scale).map(|(e, s)| e / s).collect() };
        let pool = |values: &[f64]| {
            (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
        };
        let nrmse = over(self.clean.standard_deviations());
        let nrmse_hydrodynamic = over(self.hydrodynamic.standard_deviations());
        OpenLoopRow {
            name: name.to_owned(),
            mae: mean(&self.absolute),
            pooled: pool(&nrmse),
            pooled_hydrodynamic: pool(&nrmse_hydrodynamic),
            rmse,
            nrmse,
            nrmse_hydrodynamic,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_definition() {
        let mut sums = Accumulator::new(1);
        // Clean 0, 2, 4: standard deviation sqrt(8/3). Hydrodynamic part 0, 1, 2: sqrt(2/3). Errors 1, -1, 2.
        for (predicted, clean, hydrostatic) in [(1.0, 0.0, 0.0), (1.0, 2.0, 1.0), (6.0, 4.0, 2.0)] {
            sums.add(&[predicted], &[clean], &[hydrostatic]);
        }
        let row = sums.row("model");
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-12, "{got} {want}");
        close(row.mae[0], 4.0 / 3.0);
        close(row.rmse[0], 2f64.sqrt());
        close(row.pooled, 2f64.sqrt() / (8f64 / 3.0).sqrt());
        close(row.pooled_hydrodynamic, 2f64.sqrt() / (2f64 / 3.0).sqrt());
    }
}
