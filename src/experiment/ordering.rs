//! Is one model better than another, and how sure is that?

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Bootstrap draws.
const DRAWS: usize = 4000;

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
    /// Share of draws in which it is below 1.
    pub probability: f64,
}

/// Mean square errors `[seed][trajectory]` of both, over the same trajectories. The bootstrap draws seeds (of each on its own:
/// runs of one number share nothing but it) and trajectories (the same of both). With three seeds the interval is wide, and
/// should be. None without a seed or a trajectory.
pub fn order(
    data: &str,
    (better, a): (&str, &[Vec<f64>]),
    (worse, b): (&str, &[Vec<f64>]),
) -> Option<Ordering> {
    let trajectories = a.first()?.len();
    let same = a.iter().chain(b).all(|seed| seed.len() == trajectories);
    if b.is_empty() || trajectories == 0 || !same {
        return None;
    }
    let mean = |of: &[Vec<f64>], seeds: &[usize], picked: &[usize]| -> f64 {
        let sum: f64 = seeds
            .iter()
            .map(|seed| picked.iter().map(|at| of[*seed][*at]).sum::<f64>())
            .sum();
        sum / seeds.len() as f64
    };
    let ratio = |seeds: [&[usize]; 2], picked: &[usize]| {
        (mean(a, seeds[0], picked) / mean(b, seeds[1], picked)).sqrt()
    };
    let all = |count: usize| (0..count).collect::<Vec<_>>();
    let whole = ratio([&all(a.len()), &all(b.len())], &all(trajectories));
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut draw =
        |count: usize| -> Vec<usize> { (0..count).map(|_| rng.random_range(0..count)).collect() };
    let mut ratios: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let seeds = [draw(a.len()), draw(b.len())];
            ratio([&seeds[0], &seeds[1]], &draw(trajectories))
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    let below = ratios.iter().filter(|ratio| **ratio < 1.0).count();
    Some(Ordering {
        data: data.to_owned(),
        better: better.to_owned(),
        worse: worse.to_owned(),
        ratio: whole,
        ci95: [ratios[DRAWS / 40], ratios[DRAWS - 1 - DRAWS / 40]],
        probability: below as f64 / DRAWS as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of three seeds on 40 trajectories, that of seed s scaled by `of[s]`.
    fn errors(of: [f64; 3]) -> Vec<Vec<f64>> {
        let trajectory = |t: usize| 1.0 + 0.5 * ((t * 37 % 40) as f64 / 40.0);
        of.iter()
            .map(|scale| (0..40).map(|t| scale * trajectory(t)).collect())
            .collect()
    }

    #[test]
    fn a_clear_lead_is_certain_and_a_doubtful_one_is_not() {
        let (fine, poor) = (errors([1.0, 1.05, 0.95]), errors([4.0, 4.1, 3.9]));
        let clear = order("2", ("a", &fine), ("b", &poor)).expect("compares");
        assert!((clear.ratio - 0.5).abs() < 1e-12, "{clear:?}");
        assert!(clear.ci95[0] < 0.5 && 0.5 < clear.ci95[1] && clear.ci95[1] < 0.6);
        assert!(clear.probability > 0.9999);
        let back = order("2", ("b", &poor), ("a", &fine)).expect("compares");
        assert!((back.ratio - 2.0).abs() < 1e-12 && back.probability < 1e-4);
        let wide = errors([0.5, 1.0, 2.0]);
        let doubtful = order("2", ("a", &errors([1.1, 1.0, 1.2])), ("b", &wide)).expect("compares");
        assert!((0.05..0.95).contains(&doubtful.probability), "{doubtful:?}");
        assert!(doubtful.ci95[0] < 1.0 && doubtful.ci95[1] > 1.0);
    }

    #[test]
    fn nothing_is_compared_with_nothing_or_with_other_trajectories() {
        let some = errors([1.0; 3]);
        assert_eq!(order("2", ("a", &some), ("b", &[])), None);
        assert_eq!(order("2", ("a", &[]), ("b", &some)), None);
        assert_eq!(order("2", ("a", &some), ("b", &[vec![1.0; 7]])), None);
    }
}
