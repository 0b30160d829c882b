//! Median and mean over runs.

use serde::{Deserialize, Serialize};

/// Median, mean and standard error of the mean over runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median over runs.
    pub median: f64,
    /// Mean over runs.
    pub mean: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
}

impl Spread {
    /// Spread of one value a run; a run that diverged counts as infinite.
    pub fn from_values(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        if n == 0 {
            return Self {
                median: f64::NAN,
                mean: f64::NAN,
                standard_error: f64::NAN,
            };
        }
        let median = (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0;
        let mean = sorted.iter().sum::<f64>() / n as f64;
        let variance = sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
            / (n.saturating_sub(1).max(1)) as f64;
        Self {
            median,
            mean,
            standard_error: (variance / n as f64).sqrt(),
        }
    }
}
