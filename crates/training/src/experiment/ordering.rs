//! Is one model better than another, and how sure is that?

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
    /// Who is claimed to be better: label of the row.
    pub better: String,
    /// Than whom.
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
/// None with fewer than two seeds: they would say nothing of another training.
pub fn order(
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
mod tests {
    use super::*;

    /// Errors of seeds on 40 trajectories, that of seed s scaled by `of[s]`.
    fn errors(of: &[f64]) -> Vec<Vec<f64>> {
        let trajectory = |t: usize| 1.0 + 0.5 * ((t * 37 % 40) as f64 / 40.0);
        of.iter()
            .map(|scale| (0..40).map(|t| scale * trajectory(t)).collect())
            .collect()
    }

    #[test]
    fn a_clear_lead_is_sure_and_a_doubtful_one_is_not() {
        let (fine, poor) = (errors(&[1.0, 1.05, 0.95]), errors(&[4.0, 4.1, 3.9]));
        let clear = order("2", ("a", &fine), ("b", &poor)).expect("compares");
        assert!((clear.ratio - 0.5).abs() < 2e-3, "{clear:?}");
        assert!(
            clear.ci95[0] < 0.5 && 0.5 < clear.ci95[1] && clear.ci95[1] < 0.6,
            "{clear:?}"
        );
        assert!(clear.probability > 0.999, "{clear:?}");
        let back = order("2", ("b", &poor), ("a", &fine)).expect("compares");
        assert!((back.ratio * clear.ratio - 1.0).abs() < 1e-12 && back.probability < 1e-3);
        let doubtful = order(
            "2",
            ("a", &errors(&[1.1, 1.0, 1.2])),
            ("b", &errors(&[0.5, 1.0, 2.0])),
        );
        let doubtful = doubtful.expect("compares");
        assert!((0.05..0.95).contains(&doubtful.probability), "{doubtful:?}");
        assert!(doubtful.ci95[0] < 1.0 && doubtful.ci95[1] > 1.0);
    }

    /// Two equal models of three seeds each, 400 times: what is said to be 95 % sure is wrong in about 5 %.
    #[test]
    fn intervals_cover_what_they_say() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut seeds = || {
            let mut of = [0.0; 3];
            for scale in &mut of {
                // Twelve uniform numbers less their mean are nearly normal.
                let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
                *scale = (0.2 * normal).exp().powi(2);
            }
            errors(&of)
        };
        let runs = 400;
        let held = (0..runs)
            .filter(|_| {
                let found = order("2", ("a", &seeds()), ("b", &seeds())).expect("compares");
                found.ci95[0] <= 1.0 && 1.0 <= found.ci95[1]
            })
            .count();
        let share = held as f64 / f64::from(runs);
        assert!((0.92..=0.99).contains(&share), "{share}");
    }

    #[test]
    fn nothing_is_said_without_a_second_seed_or_of_other_trajectories() {
        let some = errors(&[1.0, 1.1, 0.9]);
        for other in [vec![], errors(&[1.0]), vec![vec![1.0; 7]; 3]] {
            assert_eq!(order("2", ("a", &some), ("b", &other)), None);
            assert_eq!(order("2", ("a", &other), ("b", &some)), None);
        }
    }
}
