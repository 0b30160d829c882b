//! White noise of logged commands: how large it is, and the commands without it.
//!
//! Logged torques are often measured. Simulated with their noise, a model does what the robot did not, and effects that
//! smooth a command (a lag) take some of it away. The command is taken to be a random walk of its slope, with steps that are
//! mostly small and now and then large (a Cauchy distribution's: torques jump where dry friction turns); how small,
//! generalised cross-validation says.
//!
//! Sources: E. T. Whittaker, Proc. Edinburgh Math. Soc. 41 (1923), for the smoother; K. L. Lange, R. J. A. Little and
//! J. M. G. Taylor, J. Am. Stat. Assoc. 84 (1989), for the weights of steps; P. Craven and G. Wahba, Numer. Math. 31 (1979).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::{
    options::CandidateOptions,
    problem::{channels::MeasuredTrial, sensor_noise::white_noise},
    statistics::standard_normal,
};

/// Ratios of the noise's variance to that of a step of the slope that are tried, as powers of ten in halves: 0.01 to 1e6.
const RATIOS: std::ops::RangeInclusive<i32> = -4..=12;
/// Orders of the differences that must all show noise, where they are.
const ORDERS: [usize; 2] = [3, 6];
/// Times that the steps are weighed at each.
const WEIGHINGS: usize = 8;

/// Commands of trials as they may have been.
pub(crate) struct Smoothed {
    /// Standard deviation of the noise that each command was logged with; zero where none shows.
    pub(crate) noise: Vec<f64>,
    /// The commands without it, trial by trial, row after row.
    pub(crate) data: Vec<Vec<f64>>,
}

/// Smooths the commands that seem to be logged with white noise; `None` where none does.
pub(crate) fn smoothed(trials: &[MeasuredTrial], options: &CandidateOptions) -> Option<Smoothed> {
    let width = trials.iter().map(|trial| trial.control.width()).max()?;
    let mut found = Smoothed {
        noise: vec![0.0; width],
        data: trials.iter().map(|of| of.control.data.clone()).collect(),
    };
    for command in 0..width {
        let logged: Vec<Vec<f64>> = trials
            .iter()
            .map(|trial| match trial.steady {
                true => Vec::new(),
                false => trial.control.column_values(command).collect(),
            })
            .collect();
        let noise = logged_noise(&logged);
        if noise.sqrt() <= options.least_command_noise * spread(&logged) {
            continue;
        }
        found.noise[command] = noise.sqrt();
        let smooth = smooth(&logged, noise);
        for (data, smooth) in found.data.iter_mut().zip(&smooth) {
            for (row, value) in smooth.iter().enumerate() {
                let into = &mut data[row * width + command];
                // What is missing stays so.
                if into.is_finite() {
                    *into = *value;
                }
            }
        }
    }
    found.noise.iter().any(|of| *of > 0.0).then_some(found)
}

/// Variance of a command's white noise; zero where none shows. What moves fast but smoothly has smaller differences of a high
/// order; a log too short for these has the others.
fn logged_noise(logged: &[Vec<f64>]) -> f64 {
    let each = ORDERS
        .iter()
        .filter_map(|order| white_noise(logged, *order));
    each.reduce(f64::min).unwrap_or(0.0)
}

/// Root mean square of what a command does about its mean.
fn spread(logged: &[Vec<f64>]) -> f64 {
    let all = || logged.iter().flatten().filter(|value| value.is_finite());
    let count = all().count().max(1) as f64;
    let mean = all().sum::<f64>() / count;
    (all().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// The smooth series that cross-validation likes best, `noise` the variance of theirs. From ratio to ratio each starts from
/// the one before: a jump that was never smeared is kept.
fn smooth(logged: &[Vec<f64>], noise: f64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let probes: Vec<Vec<f64>> = logged
        .iter()
        .map(|of| {
            of.iter()
                .map(|_| 1.0_f64.copysign(standard_normal(&mut rng)))
                .collect()
        })
        .collect();
    let mut at = logged.to_vec();
    let mut best = (f64::INFINITY, logged.to_vec());
    for half in RATIOS {
        let ratio = 10.0_f64.powf(0.5 * f64::from(half));
        let (mut left, mut freedom, mut count) = (0.0, 0.0, 0_usize);
        for ((of, at), probe) in logged.iter().zip(&mut at).zip(&probes) {
            let Some(trace) = smoother(of, at, (ratio, noise), probe) else {
                continue;
            };
            freedom += trace;
            for (a, b) in of.iter().zip(at.iter()).filter(|(a, _)| a.is_finite()) {
                left += (a - b).powi(2);
                count += 1;
            }
        }
        let score = left / (1.0 - freedom / count.max(1) as f64).powi(2);
        if score < best.0 {
            best = (score, at.clone());
        }
    }
    best.1
}

/// Brings a series to the likeliest near it whose noise has a variance and whose slope's steps have one `ratio` times smaller,
/// and estimates the trace of the matrix that smooths from a random vector of ones and minus ones (M. F. Hutchinson, Commun.
/// Stat. Simul. Comput. 19, 1990). `None`, and as it is, where so few values are there that nothing tells.
fn smoother(
    logged: &[f64],
    smooth: &mut Vec<f64>,
    (ratio, noise): (f64, f64),
    probe: &[f64],
) -> Option<f64> {
    if logged.iter().filter(|value| value.is_finite()).count() < 4 {
        return None;
    }
    let mut ratios = Vec::new();
    let mut at = smooth.clone();
    for _ in 0..WEIGHINGS {
        let steps = at.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]);
        let weighed = steps.map(|step| match step.is_finite() {
            true => ratio * 2.0 / (1.0 + step * step * ratio / noise),
            false => ratio,
        });
        ratios = weighed.collect();
        at = least_squares(logged, &ratios)?;
    }
    let probe = logged.iter().zip(probe);
    let probe: Vec<f64> = probe.map(|(of, probe)| of * 0.0 + probe).collect();
    let answer = least_squares(&probe, &ratios)?;
    *smooth = at;
    let product = probe.iter().zip(answer).filter(|(a, _)| a.is_finite());
    Some(product.map(|(a, b)| a * b).sum())
}

/// The series with the least sum of squared deviations and of second differences, each squared and times a ratio.
fn least_squares(logged: &[f64], ratios: &[f64]) -> Option<Vec<f64>> {
    let rows = logged.len();
    // Bands of the normal matrix: the diagonal and the two below it.
    let mut bands = vec![[0.0; 3]; rows];
    let mut right = vec![0.0; rows];
    for (row, value) in logged.iter().enumerate() {
        if value.is_finite() {
            bands[row][0] = 1.0;
            right[row] = *value;
        }
    }
    const SECOND: [f64; 3] = [1.0, -2.0, 1.0];
    for (first, ratio) in ratios.iter().enumerate() {
        for (at, a) in SECOND.iter().enumerate() {
            for (below, b) in SECOND[at..].iter().enumerate() {
                bands[first + at][below] += ratio * a * b;
            }
        }
    }
    // L D L', L with a unit diagonal.
    for row in 0..rows {
        let pivot = bands[row][0];
        if pivot <= 0.0 {
            return None;
        }
        let [_, one, two] = bands[row];
        if row + 1 < rows {
            bands[row + 1][0] -= one * one / pivot;
            bands[row + 1][1] -= one * two / pivot;
        }
        if row + 2 < rows {
            bands[row + 2][0] -= two * two / pivot;
        }
        bands[row][1] = one / pivot;
        bands[row][2] = two / pivot;
        for below in 1..=2 {
            if row + below < rows {
                right[row + below] -= bands[row][below] * right[row];
            }
        }
    }
    for row in (0..rows).rev() {
        right[row] /= bands[row][0];
        for below in 1..=2 {
            if row + below < rows {
                right[row] -= bands[row][below] * right[row + below];
            }
        }
    }
    Some(right)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// The smoother solves the whole normal matrix; a missing value weighs nothing.
    #[test]
    fn it_solves_the_normal_equations() {
        let rows = 9;
        let mut logged: Vec<f64> = (0..rows).map(|row| ((row * row) % 7) as f64).collect();
        logged[4] = f64::NAN;
        let ratios: Vec<f64> = (0..rows - 2).map(|of| 1.0 + of as f64).collect();
        let differences = DMatrix::from_fn(rows - 2, rows, |row, column| {
            match column - row.min(column) {
                0 if column == row => 1.0,
                1 => -2.0,
                2 => 1.0,
                _ => 0.0,
            }
        });
        let weights = DVector::from_fn(rows, |row, _| f64::from(logged[row].is_finite()));
        let normal = DMatrix::from_diagonal(&weights)
            + differences.transpose()
                * DMatrix::from_diagonal(&DVector::from_row_slice(&ratios))
                * &differences;
        let known = DVector::from_fn(rows, |row, _| match logged[row].is_finite() {
            true => logged[row],
            false => 0.0,
        });
        let expected = normal.lu().solve(&known).unwrap();
        let found = least_squares(&logged, &ratios).unwrap();
        assert!((DVector::from_vec(found) - expected).norm() < 1e-12);
        let (few, mut before) = (&logged[..3], vec![7.0; 3]);
        assert!(smoother(few, &mut before, (1.0, 1.0), &[1.0; 3]).is_none());
        assert_eq!(before, [7.0; 3]);
    }

    /// Of the noise of a slow sine less than a third is left; a jump of the command stays.
    #[test]
    fn noise_is_found_and_taken_away() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let sine =
            |row: i32| 4.0 * (0.02 * f64::from(row)).sin() + if row < 700 { 0.0 } else { 5.0 };
        let clean: Vec<f64> = (0..1500).map(sine).collect();
        let noisy: Vec<f64> = (clean.iter())
            .map(|of| of + 0.2 * standard_normal(&mut rng))
            .collect();
        let noise = logged_noise(std::slice::from_ref(&noisy));
        assert!((noise.sqrt() / 0.2 - 1.0).abs() < 0.1, "{noise}");
        let smooth = smooth(std::slice::from_ref(&noisy), noise);
        let errors = || smooth[0].iter().zip(&clean).map(|(a, b)| (a - b).abs());
        let left = (errors().map(|of| of * of).sum::<f64>() / 1500.0).sqrt();
        assert!(left < 0.06, "{left}");
        let jump = errors().skip(695).take(10).fold(0.0, f64::max);
        assert!(jump < 0.5, "{jump}");
    }

    /// A command held for many rows has none, nor has one that is smooth.
    #[test]
    fn steps_and_smooth_commands_show_none() {
        let steps: Vec<f64> = (0..600).map(|row| f64::from((row / 50) % 3)).collect();
        assert_eq!(logged_noise(&[steps]), 0.0);
        let least = CandidateOptions::default().least_command_noise;
        for rate in [0.01, 0.3] {
            let smooth: Vec<f64> = (0..600).map(|row| (rate * f64::from(row)).sin()).collect();
            let noise = logged_noise(std::slice::from_ref(&smooth)).sqrt();
            assert!(noise < least * spread(&[smooth]), "{rate}: {noise}");
        }
        assert_eq!(logged_noise(&[vec![1.0; 3]]), 0.0);
        assert!(logged_noise(&[vec![0.0, 1.0, -1.0, 1.0, 0.0]]) > 0.0);
    }
}
