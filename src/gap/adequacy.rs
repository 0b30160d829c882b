//! Does a fit leave only noise? Judged by simulation, at several scales of time.
//!
//! What a missing effect leaves is smooth, noise is not: sums over blocks of rows show structure that the
//! sum of squares drowns in noise. For every sensor and block length the squared block means are added up
//! and compared with the same of simulated residuals, and the largest deviation is judged by its own
//! simulated distribution (maxT). A simulated residual is noise, plus an error of form where the fit holds
//! effects (the catalogue's forms are only about nature's), less what starts, knobs and parameters absorb
//! to first order.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{
    bench::Bench, error::GapError, find::normal, fit::Fit, leftover, measured, watch::Watch,
};

/// Simulated residuals; the least p-value is one over one more.
const DRAWS: usize = 199;
/// Lengths of the blocks [rows].
const BLOCKS: [usize; 3] = [1, 4, 16];
/// An effect's form differs from nature's by about this part of what the effect does ...
const FORM_ERROR: f64 = 0.15;
/// ... which changes from one such stretch of rows to the next.
const FORM_ROWS: usize = 25;
/// Coloured noise of a sensor that declares none is believed up to this part of its spread.
const BELIEVED: f64 = 0.1;

/// How well a fit explains the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Adequacy {
    /// Probability of a deviation as large, were the fit right.
    pub(super) p_value: f64,
    /// The largest deviation over sensors and scales, in standard deviations.
    pub(super) deviation: f64,
}

/// Variance and colour of the simulated noise of one channel.
#[derive(Clone, Copy)]
struct Noise {
    sd: f64,
    /// Correlation of neighbouring rows (first-order autoregressive).
    correlation: f64,
}

/// Simulates what a fit would leave were it right, and compares.
///
/// # Errors
/// A stop that was asked for.
pub(super) fn of(
    bench: &Bench<'_>,
    fit: &Fit,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Adequacy, GapError> {
    let noise = noises(bench, fit);
    let z = {
        let knobs = bench.knobs.len();
        let all = bench.normalised(&fit.point);
        all.rows(knobs, all.len() - knobs).into_owned()
    };
    let draw = |at: usize| -> DMatrix<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(at as u64);
        let simulated = simulate(fit, at, &noise, &z, &mut rng);
        bench.projection(at).project(&simulated)
    };
    let columns = |at: usize| -> DMatrix<f64> {
        let (_, shared) = &bench.shared[at];
        let of = &fit.columns[at];
        let knobs = of.knobs.as_ref().unwrap_or(shared);
        let mut all = DMatrix::zeros(knobs.nrows(), knobs.ncols() + of.own.ncols());
        all.view_mut((0, 0), knobs.shape())
            .copy_from(&knobs.map(f64::from));
        all.view_mut((0, knobs.ncols()), of.own.shape())
            .copy_from(&of.own.map(f64::from));
        all
    };
    let segments = 0..bench.segments.len();
    let mut precision = fit.quadratic().a;
    for axis in 0..precision.nrows() {
        precision[(axis, axis)] += 1.0;
    }
    watch.check()?;
    let slopes: Vec<DMatrix<f64>> = segments
        .clone()
        .into_par_iter()
        .map(|at| columns(at).transpose() * draw(at))
        .collect();
    let slope = slopes
        .into_iter()
        .reduce(|a, b| a + b)
        .unwrap_or_else(|| DMatrix::zeros(precision.nrows(), DRAWS));
    let Some(factor) = precision.cholesky() else {
        return Ok(Adequacy {
            p_value: 1.0,
            deviation: 0.0,
        });
    };
    let absorbed = factor.solve(&slope);
    watch.check()?;
    let sums: Vec<(DMatrix<f64>, DVector<f64>)> = segments
        .into_par_iter()
        .map(|at| {
            let left = draw(at) - bench.projection(at).project(&(columns(at) * &absorbed));
            let observed = DMatrix::from_column_slice(left.nrows(), 1, &fit.residuals[at]);
            (
                statistics(bench, &fit.residuals[at], &left),
                statistics(bench, &fit.residuals[at], &observed)
                    .column(0)
                    .into_owned(),
            )
        })
        .collect();
    let (nulls, observed) = sums
        .into_iter()
        .reduce(|a, b| (a.0 + b.0, a.1 + b.1))
        .unwrap_or_else(|| (DMatrix::zeros(0, DRAWS), DVector::zeros(0)));
    Ok(judge(&nulls, &observed))
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
fn statistics(bench: &Bench<'_>, present: &[f64], residuals: &DMatrix<f64>) -> DMatrix<f64> {
    let width = bench.channels.len();
    let rows = present.len() / width;
    let sources = &bench.channels.sources;
    let mut sums = DMatrix::zeros(BLOCKS.len() * (sources.len() + 1), residuals.ncols());
    for (scale, length) in BLOCKS.iter().enumerate() {
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

/// White noise of unit variance where the model declares it; where it declares none, that of what is left,
/// as long as that is small beside the readings.
fn noises(bench: &Bench<'_>, fit: &Fit) -> Vec<Noise> {
    let leftovers = leftover::by_channel(bench, &fit.residuals);
    let spreads = measured::spreads(bench.trials, bench.channels);
    bench
        .channels
        .list
        .iter()
        .zip(leftovers)
        .zip(spreads)
        .map(|((channel, left), spread)| {
            if channel.declared_noise.is_some() {
                return Noise {
                    sd: 1.0,
                    correlation: 0.0,
                };
            }
            let believed = BELIEVED * spread / channel.noise;
            Noise {
                sd: left.variance.sqrt().min(believed).max(1.0),
                correlation: (left.time - 1.0) / (left.time + 1.0),
            }
        })
        .collect()
}

/// Noise and errors of form of one segment [readings, DRAWS]; zero where there is no reading.
fn simulate(
    fit: &Fit,
    at: usize,
    noise: &[Noise],
    z: &DVector<f64>,
    rng: &mut ChaCha8Rng,
) -> DMatrix<f64> {
    let present = &fit.residuals[at];
    let width = noise.len();
    let rows = present.len() / width;
    let own = fit.columns[at].own.map(f64::from);
    // What every candidate of the fit does, by itself.
    let mut first = 0;
    let contributions: Vec<DVector<f64>> = fit
        .point
        .values
        .iter()
        .map(|values| {
            let range = first..first + values.len();
            first = range.end;
            own.columns(range.start, range.len()) * z.rows(range.start, range.len())
        })
        .collect();
    let mut all = DMatrix::zeros(present.len(), DRAWS);
    let mut before = vec![0.0; width];
    for mut column in all.column_iter_mut() {
        for (value, of) in before.iter_mut().zip(noise) {
            *value = of.sd * normal(rng);
        }
        for row in 0..rows {
            for (channel, of) in noise.iter().enumerate() {
                let fresh = of.sd * (1.0 - of.correlation * of.correlation).sqrt() * normal(rng);
                before[channel] = of.correlation * before[channel] + fresh;
                column[row * width + channel] = before[channel];
            }
        }
        for contribution in &contributions {
            let knots: Vec<f64> = (0..rows / FORM_ROWS + 2)
                .map(|_| FORM_ERROR * normal(rng))
                .collect();
            for row in 0..rows {
                let (knot, part) = (row / FORM_ROWS, (row % FORM_ROWS) as f64 / FORM_ROWS as f64);
                let error = knots[knot] * (1.0 - part) + knots[knot + 1] * part;
                for place in row * width..(row + 1) * width {
                    column[place] += error * contribution[place];
                }
            }
        }
        for (value, present) in column.iter_mut().zip(present) {
            if *present == 0.0 {
                *value = 0.0;
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deviation_that_no_draw_reaches_is_improbable() {
        let nulls = DMatrix::from_fn(2, DRAWS, |row, draw| ((row + 1) * (draw * 37 % 101)) as f64);
        let usual = judge(&nulls, &DVector::from_vec(vec![50.0, 100.0]));
        let large = judge(&nulls, &DVector::from_vec(vec![50.0, 1000.0]));
        assert!(usual.p_value > 0.5, "{usual:?}");
        assert!((large.p_value - 1.0 / 200.0).abs() < 1e-12, "{large:?}");
    }
}
