//! Readings that stand alone: a frame of a film that was misread, a lost bit.

use nalgebra::{DMatrix, DVector};

use crate::{
    options::OutlierOptions,
    problem::channels::{Channels, MeasuredTrial, Source},
};

/// Turns readings into lost ones that miss the parabola through their neighbours by more than the options allow, while those
/// follow it. Only of sensors that declare no noise: a declared one says how large errors are. Judged are the first row, the
/// last, and all that have enough rows on either side. Returns the sensors, each with its number of such readings.
pub(crate) fn remove(
    channels: &Channels,
    trials: &mut [MeasuredTrial],
    options: &OutlierOptions,
) -> Vec<(String, usize)> {
    let mut removed: Vec<(String, usize)> = Vec::new();
    for source in channels.sources.iter().filter(|of| !of.attitude) {
        let channel = &channels.list[source.channel];
        if channel.declared_noise.is_some() {
            continue;
        }
        let mut count = 0;
        for trial in trials.iter_mut().filter(|trial| !trial.steady) {
            for component in 0..source.channels {
                let noise = channels.list[source.channel + component].noise;
                let alone = alone(trial, source, component, noise, options);
                count += alone.len();
                for row in alone {
                    trial.values[row * trial.width + source.start + component] = f64::NAN;
                }
            }
        }
        if count > 0 {
            removed.push((channel.sensor.clone(), count));
        }
    }
    removed
}

/// Rows of a trial in which a reading stands alone.
fn alone(
    trial: &MeasuredTrial,
    source: &Source,
    component: usize,
    noise: f64,
    options: &OutlierOptions,
) -> Vec<usize> {
    let value = |row: usize| trial.row(row)[source.start + component];
    let rows: Vec<usize> = (0..trial.times.len())
        .filter(|row| value(*row).is_finite())
        .collect();
    let all = 0..rows.len();
    all.clone()
        .filter(|at| {
            let last = rows.len().saturating_sub(2 * options.beside + 1);
            let first = at.saturating_sub(options.beside).min(last);
            let others: Vec<usize> = (first..=first + 2 * options.beside)
                .filter(|other| other != at && all.contains(other))
                .map(|other| rows[other])
                .collect();
            let is_judged = (options.beside..rows.len().saturating_sub(options.beside))
                .contains(at)
                || *at == 0
                || at + 1 == rows.len();
            is_judged
                && stands_alone(
                    &others
                        .iter()
                        .map(|row| (trial.times[*row] - trial.times[rows[*at]], value(*row)))
                        .collect::<Vec<_>>(),
                    value(rows[*at]),
                    noise,
                    options,
                )
        })
        .map(|at| rows[at])
        .collect()
}

/// True where a reading at time zero misses the parabola through its neighbours, which they follow.
fn stands_alone(
    neighbours: &[(f64, f64)],
    value: f64,
    noise: f64,
    options: &OutlierOptions,
) -> bool {
    if neighbours.len() < 2 * options.beside {
        return false;
    }
    let longest = neighbours
        .iter()
        .fold(0.0_f64, |m, (time, _)| m.max(time.abs()));
    let design = DMatrix::from_fn(neighbours.len(), 3, |row, power| {
        (neighbours[row].0 / longest).powi(power as i32)
    });
    let readings = DVector::from_iterator(neighbours.len(), neighbours.iter().map(|of| of.1));
    let Some(factor) = design.tr_mul(&design).cholesky() else {
        return false;
    };
    let parabola = factor.solve(&design.tr_mul(&readings));
    let left = &readings - &design * &parabola;
    let rms = (left.norm_squared() / (neighbours.len() - 3) as f64).sqrt();
    // Variance of the prediction at time zero, that of the reading with it.
    let variance = 1.0 + factor.inverse()[(0, 0)];
    rms <= options.smooth * noise
        && (value - parabola[0]).abs() > options.deviation * noise * variance.sqrt()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn channels(declared: Option<f64>) -> Channels {
        let mut channels = Channels::single(0.1);
        channels.list[0].declared_noise = declared;
        channels
    }

    fn trial(values: Vec<f64>) -> MeasuredTrial {
        MeasuredTrial {
            name: String::new(),
            times: (0..values.len()).map(|row| 0.1 * row as f64).collect(),
            values,
            width: 1,
            ..MeasuredTrial::default()
        }
    }

    fn lost(values: &[f64], declared: Option<f64>) -> Vec<usize> {
        let mut trials = [trial(values.to_vec())];
        remove(&channels(declared), &mut trials, &OutlierOptions::default());
        (0..values.len())
            .filter(|row| trials[0].values[*row].is_nan())
            .collect()
    }

    /// A fall, with a little noise.
    fn fall() -> Vec<f64> {
        let noise = [0.05, -0.08, 0.1, -0.02, -0.1, 0.07];
        (0..40)
            .map(|row| 50.0 - 4.9 * (0.1 * row as f64).powi(2) + noise[row % 6])
            .collect()
    }

    #[test]
    fn readings_that_stand_alone_are_lost_at_the_ends_and_between() {
        assert_eq!(lost(&fall(), None), [0_usize; 0]);
        for row in [0, 17, 39] {
            let mut values = fall();
            values[row] += 2.0;
            assert_eq!(lost(&values, None), [row]);
            assert_eq!(lost(&values, Some(0.1)), [0_usize; 0]);
        }
    }

    /// A step is no outlier, nor is what two rows agree on.
    #[test]
    fn steps_and_corners_stay() {
        let mut values = fall();
        values[20..].iter_mut().for_each(|value| *value += 3.0);
        assert_eq!(lost(&values, None), [0_usize; 0]);
        let mut values = fall();
        values[38] += 2.0;
        values[39] += 2.0;
        assert_eq!(lost(&values, None), [0_usize; 0]);
    }
}
