//! Ratio of two models' errors, with a confidence interval.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF as _, StudentsT};

/// Bootstrap draws.
const DRAWS: usize = 1000;

/// Two rows of a table compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ordering {
    /// Name of the data set.
    pub data: String,
    /// Label of the row claimed to be better.
    pub better: String,
    /// Label of the row claimed to be worse.
    pub worse: String,
    /// nRMSE of the former over that of the latter; below 1 the claim holds.
    pub ratio: f64,
    /// 95 % interval of the ratio.
    pub ci95: [f64; 2],
    /// One-sided confidence that it is below 1.
    pub probability: f64,
}

/// Mean square errors `[seed][trajectory]` of both, over the same trajectories. The ratio is that of the geometric means over
/// seeds of each seed's nRMSE. Its logarithm has a variance from either's seeds (Welch), which with three of them is known
/// badly, so that the interval is Student's; and one from the choice of test trajectories, the same for both (bootstrap).
/// `None` with fewer than two seeds, which say nothing of another training.
pub fn ordering(
    data: &str,
    (better, a): (&str, &[Vec<f64>]),
    (worse, b): (&str, &[Vec<f64>]),
) -> Option<Ordering> {
    let trajectories = a.first()?.len();
    let same = a.iter().chain(b).all(|seed| seed.len() == trajectories);
    if a.len() < 2 || b.len() < 2 || trajectories < 2 || !same {
        return None;
    }
    let all: Vec<usize> = (0..trajectories).collect();
    let (of_a, of_b) = (logarithms(a, &all), logarithms(b, &all));
    let log_ratio = mean(&of_a) - mean(&of_b);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let drawn: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let picked: Vec<usize> = (0..trajectories)
                .map(|_| rng.random_range(0..trajectories))
                .collect();
            mean(&logarithms(a, &picked)) - mean(&logarithms(b, &picked))
        })
        .collect();
    // Each variance of a mean with its degrees of freedom; together by Welch and Satterthwaite.
    let parts = [
        (variance(&of_a) / a.len() as f64, a.len() - 1),
        (variance(&of_b) / b.len() as f64, b.len() - 1),
        (variance(&drawn), trajectories - 1),
    ];
    let total: f64 = parts.iter().map(|part| part.0).sum();
    let spread: f64 = parts
        .iter()
        .map(|part| part.0.powi(2) / part.1 as f64)
        .sum();
    let error = total.sqrt().max(f64::MIN_POSITIVE);
    let student = StudentsT::new(0.0, 1.0, (total.powi(2) / spread).max(1.0)).ok()?;
    let half = student.inverse_cdf(0.975) * error;
    Some(Ordering {
        data: data.to_owned(),
        better: better.to_owned(),
        worse: worse.to_owned(),
        ratio: log_ratio.exp(),
        ci95: [(log_ratio - half).exp(), (log_ratio + half).exp()],
        probability: student.cdf(-log_ratio / error),
    })
}

/// ln nRMSE of each seed over some trajectories.
fn logarithms(errors: &[Vec<f64>], picked: &[usize]) -> Vec<f64> {
    errors
        .iter()
        .map(|seed| {
            let sum: f64 = picked.iter().map(|at| seed[*at]).sum();
            0.5 * (sum / picked.len() as f64).ln()
        })
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Unbiased.
fn variance(values: &[f64]) -> f64 {
    let middle = mean(values);
    let square: f64 = values.iter().map(|value| (value - middle).powi(2)).sum();
    square / (values.len() - 1) as f64
}

#[cfg(test)]
#[path = "tests/ordering.rs"]
mod tests;
