//! Inputs and outputs of a network scaled to zero mean and unit standard deviation.

use serde::{Deserialize, Serialize};

/// Bound of a standardised input [standard deviations]: inputs are clamped to it, so that no state of a simulation takes
/// the network far outside its training data.
pub const INPUT_LIMIT: f64 = 20.0;

/// Means and standard deviations over the training split.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normaliser {
    /// Mean of each encoded input (SI; 1 for a direction).
    pub input_mean: Vec<f64>,
    /// Standard deviation of each encoded input; 1 for an input that is constant, so never zero.
    pub input_std: Vec<f64>,
    /// Mean of each output [N, N m].
    pub output_mean: Vec<f64>,
    /// Standard deviation of each output [N, N m].
    pub output_std: Vec<f64>,
}

impl Normaliser {
    /// A normaliser that changes nothing: means 0, deviations 1.
    pub fn identity(inputs: usize, outputs: usize) -> Self {
        Self {
            input_mean: vec![0.0; inputs],
            input_std: vec![1.0; inputs],
            output_mean: vec![0.0; outputs],
            output_std: vec![1.0; outputs],
        }
    }

    /// `value` of the encoded input `index` in standard deviations, clamped to [`INPUT_LIMIT`].
    #[inline]
    pub fn input(&self, index: usize, value: f64) -> f32 {
        let scaled = (value - self.input_mean[index]) / self.input_std[index];
        scaled.clamp(-INPUT_LIMIT, INPUT_LIMIT) as f32
    }

    /// `value` [N, N m] of the force component `index` in standard deviations.
    #[inline]
    pub fn force(&self, index: usize, value: f64) -> f32 {
        let scaled = (value - self.output_mean[index]) / self.output_std[index];
        scaled.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
    }

    /// The inverse of [`Normaliser::force`]: the force component `index` [N, N m].
    #[inline]
    pub fn to_si(&self, index: usize, normalised: f32) -> f64 {
        self.output_mean[index] + self.output_std[index] * f64::from(normalised)
    }

    /// Reason why these numbers do not serve `inputs` inputs and `outputs` outputs, if there is one.
    pub(crate) fn fault(&self, inputs: usize, outputs: usize) -> Option<String> {
        let fields = [
            ("input_mean", &self.input_mean, inputs, false),
            ("input_std", &self.input_std, inputs, true),
            ("output_mean", &self.output_mean, outputs, false),
            ("output_std", &self.output_std, outputs, true),
        ];
        fields
            .into_iter()
            .find_map(|(name, values, expected, positive)| {
                if values.len() != expected {
                    return Some(format!(
                        "normaliser.{name} has {} numbers, not {expected}",
                        values.len()
                    ));
                }
                let index = values
                    .iter()
                    .position(|v| !v.is_finite() || (positive && *v <= 0.0))?;
                Some(format!("normaliser.{name}[{index}] is {}", values[index]))
            })
    }
}

/// Mean and standard deviation of each column of a stream of rows (Welford's method in f64: B. P. Welford, "Note on a
/// method for calculating corrected sums of squares and products", Technometrics 4(3), 1962).
#[derive(Clone, Debug)]
pub struct Moments {
    count: f64,
    mean: Vec<f64>,
    square: Vec<f64>,
}

impl Moments {
    /// For rows of `len` numbers; no row yet.
    pub fn new(len: usize) -> Self {
        Self {
            count: 0.0,
            mean: vec![0.0; len],
            square: vec![0.0; len],
        }
    }

    /// Takes one more row.
    pub fn add(&mut self, row: &[f64]) {
        self.count += 1.0;
        for ((value, mean), square) in row.iter().zip(&mut self.mean).zip(&mut self.square) {
            let before = value - *mean;
            *mean += before / self.count;
            *square += before * (value - *mean);
        }
    }

    /// Means of the columns.
    pub fn mean(&self) -> Vec<f64> {
        self.mean.clone()
    }

    /// Standard deviations of the columns; 1 for a column that is constant to single precision.
    pub fn std(&self) -> Vec<f64> {
        let count = self.count.max(1.0);
        self.square
            .iter()
            .zip(&self.mean)
            .map(|(square, mean)| {
                let std = (square / count).sqrt();
                if std > 1e-6 * mean.abs().max(1e-6) {
                    std
                } else {
                    1.0
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_a_known_column_and_of_a_constant_one() {
        let mut moments = Moments::new(2);
        for value in [1.0, 3.0, 5.0, 7.0] {
            moments.add(&[value, 1000.0]);
        }
        assert_eq!(moments.mean(), [4.0, 1000.0]);
        assert_eq!(moments.std(), [5.0f64.sqrt(), 1.0]);
    }

    #[test]
    fn wild_inputs_are_held_at_the_limit() {
        let normaliser = Normaliser::identity(1, 1);
        assert_eq!(normaliser.input(0, 1e300), 20.0);
        assert_eq!(normaliser.input(0, f64::NEG_INFINITY), -20.0);
        assert!(normaliser.force(0, 1e300).is_finite());
    }

    #[test]
    fn faults_name_the_field() {
        let mut normaliser = Normaliser::identity(2, 1);
        assert_eq!(normaliser.fault(2, 1), None);
        normaliser.input_std[1] = 0.0;
        assert_eq!(
            normaliser.fault(2, 1).as_deref(),
            Some("normaliser.input_std[1] is 0")
        );
        assert_eq!(
            normaliser.fault(2, 3).as_deref(),
            Some("normaliser.input_std[1] is 0")
        );
    }
}
