//! Mean and standard deviation over seeds.

use serde::{Deserialize, Serialize};

/// Mean and standard deviation over seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeanSd {
    /// Mean.
    pub mean: f64,
    /// Standard deviation; 0 of one seed.
    pub sd: f64,
    /// Number of seeds that have a value.
    pub count: usize,
}

impl MeanSd {
    /// Mean and deviation of some values; None without any.
    pub fn from_values(values: &[f64]) -> Option<Self> {
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let sd = (square / count.saturating_sub(1).max(1) as f64).sqrt();
        (count > 0).then_some(Self { mean, sd, count })
    }
}

#[cfg(test)]
#[path = "tests/mean_sd.rs"]
mod tests;
