//! Does a fit leave only noise? Judged by simulation, at several scales of time.
//!
//! A missing effect leaves smooth residuals, noise does not: sums over blocks of rows show structure that the
//! sum of squares drowns in noise. For every sensor and block length the squared block means are added up
//! and compared with the same of simulated residuals, and the largest deviation is judged by its own
//! simulated distribution (maxT). A simulated residual is noise, plus an error of form where the fit holds
//! effects (the catalogue's forms are only about nature's), less what starts, nuisance parameters and parameters absorb.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    discrepancy::{noise_estimation, noise_model::Noise, simulated_residuals::SimulatedResiduals},
    error::GapError,
    fit::{
        hypothesis::Fit,
        linearized_problem::{Adequacy, LinearizedProblem},
    },
    problem::channels,
    progress::Watch,
};

/// Simulates what a fit would leave were it right, and compares.
///
/// # Errors
/// A stop that was asked for.
pub(crate) fn assess(
    linearized: &LinearizedProblem<'_>,
    fit: &Fit,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Adequacy, GapError> {
    let options = &linearized.problem.options.discrepancy;
    let Some(simulated) = SimulatedResiduals::new(
        linearized,
        fit,
        options.adequacy_draws,
        options.form_error,
        seed,
    ) else {
        return Ok(Adequacy {
            p_value: 1.0,
            deviation: 0.0,
        });
    };
    let noise = believed(
        linearized,
        noise_estimation::estimate(linearized, fit, seed),
    );
    watch.check()?;
    let absorbed = simulated.absorbed(&noise);
    watch.check()?;
    let sums: Vec<(DMatrix<f64>, DVector<f64>)> = (0..linearized.problem.segments.len())
        .into_par_iter()
        .map(|at| {
            let left = simulated.remaining(at, &noise, &absorbed);
            let observed = DMatrix::from_column_slice(left.nrows(), 1, &fit.residuals[at]);
            (
                statistics(linearized, &fit.residuals[at], &left),
                statistics(linearized, &fit.residuals[at], &observed)
                    .column(0)
                    .into_owned(),
            )
        })
        .collect();
    let (nulls, observed) = sums
        .into_iter()
        .reduce(|a, b| (a.0 + b.0, a.1 + b.1))
        .unwrap_or_else(|| (DMatrix::zeros(0, options.adequacy_draws), DVector::zeros(0)));
    Ok(judge(&nulls, &observed))
}

/// Whether the fit of the empty set leaves only noise; computed once.
///
/// # Errors
/// The nominal diverges, or a stop was asked for.
pub(crate) fn assess_empty(
    linearized: &LinearizedProblem<'_>,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Adequacy, GapError> {
    if let Some(known) = linearized.empty_adequacy.get() {
        return Ok(*known);
    }
    let found = assess(linearized, linearized.empty()?, seed, watch)?;
    Ok(*linearized.empty_adequacy.get_or_init(|| found))
}

/// The largest standardised statistic against its simulated distribution.
fn judge(nulls: &DMatrix<f64>, observed: &DVector<f64>) -> Adequacy {
    let mut largest = vec![f64::NEG_INFINITY; nulls.ncols()];
    let mut deviation = f64::NEG_INFINITY;
    for (row, value) in nulls.row_iter().zip(observed.iter()) {
        let mean = row.mean();
        let sd = row.variance().sqrt();
        if sd <= 0.0 || sd.is_nan() {
            continue;
        }
        deviation = deviation.max((value - mean) / sd);
        for (largest, null) in largest.iter_mut().zip(row.iter()) {
            *largest = largest.max((null - mean) / sd);
        }
    }
    let above = largest.iter().filter(|null| **null >= deviation).count();
    Adequacy {
        p_value: (above + 1) as f64 / (largest.len() + 1) as f64,
        deviation: deviation.max(0.0),
    }
}

/// Sums of squared block means [sensors and all together, times scales; columns].
fn statistics(
    linearized: &LinearizedProblem<'_>,
    present: &[f64],
    residuals: &DMatrix<f64>,
) -> DMatrix<f64> {
    let blocks = linearized.problem.options.discrepancy.adequacy_blocks;
    let width = linearized.problem.channels.len();
    let rows = present.len() / width;
    let sources = &linearized.problem.channels.sources;
    let mut sums = DMatrix::zeros(blocks.len() * (sources.len() + 1), residuals.ncols());
    for (scale, length) in blocks.iter().enumerate() {
        for (number, source) in sources.iter().enumerate() {
            for channel in source.channel..source.channel + source.channels {
                for first in (0..rows).step_by(*length) {
                    let block = first..(first + length).min(rows);
                    let there: Vec<usize> = block
                        .map(|row| row * width + channel)
                        .filter(|place| present[*place] != 0.0)
                        .collect();
                    if there.is_empty() {
                        continue;
                    }
                    for (column, of) in residuals.column_iter().enumerate() {
                        let sum: f64 = there.iter().map(|place| of[*place]).sum();
                        let square = sum * sum / there.len() as f64;
                        sums[(scale * (sources.len() + 1) + number, column)] += square;
                        sums[(scale * (sources.len() + 1) + sources.len(), column)] += square;
                    }
                }
            }
        }
    }
    sums
}

/// Noise of sensors that declare none, limited to a part of the spread of their readings.
fn believed(linearized: &LinearizedProblem<'_>, noise: Vec<Noise>) -> Vec<Noise> {
    let largest = linearized.problem.options.discrepancy.largest_noise;
    let spreads = channels::spreads(linearized.problem.trials, linearized.problem.channels);
    linearized
        .problem
        .channels
        .list
        .iter()
        .zip(noise)
        .zip(spreads)
        .map(|((channel, noise), spread)| match channel.declared_noise {
            Some(_) => noise,
            None => Noise {
                sd: noise.sd.min(largest * spread / channel.noise).max(1.0),
                ..noise
            },
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deviation_that_no_draw_reaches_is_improbable() {
        let nulls = DMatrix::from_fn(2, 199, |row, draw| ((row + 1) * (draw * 37 % 101)) as f64);
        let usual = judge(&nulls, &DVector::from_vec(vec![50.0, 100.0]));
        let large = judge(&nulls, &DVector::from_vec(vec![50.0, 1000.0]));
        assert!(usual.p_value > 0.5, "{usual:?}");
        assert!((large.p_value - 1.0 / 200.0).abs() < 1e-12, "{large:?}");
    }
}
