//! Measurement noise of sensors whose MJCF declares none: white, and slow.

use crate::{
    options::CandidateOptions,
    output::records::Channel,
    problem::channels::{self, Channels, MeasuredTrial, rotation_between},
};

/// A channel that may drift.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drifting {
    /// Its place among the channels.
    pub(crate) channel: usize,
    /// What its readings move: their root mean square about each trial's mean, in their unit.
    pub(crate) scale: f64,
}

/// The channels of sensors that declare no noise: nothing says how far their errors are correlated either.
pub(crate) fn drifting(channels: &Channels, trials: &[MeasuredTrial]) -> Vec<Drifting> {
    let means = channels::all_means(trials, channels);
    let undeclared =
        (channels.list.iter().enumerate()).filter(|(_, of)| of.declared_noise.is_none());
    undeclared
        .map(|(channel, of)| {
            let deviations = trials.iter().zip(&means).flat_map(|(trial, means)| {
                let rows = 0..trial.times.len();
                rows.map(move |row| channels::deviation(trial, channels, row, channel, means))
            });
            let deviations = deviations.filter(|value| value.is_finite());
            let (sum, count) = deviations.fold((0.0, 0_usize), |(sum, count), of| {
                (sum + of * of, count + 1)
            });
            Drifting {
                channel,
                scale: (sum / count.max(1) as f64).sqrt().max(of.noise),
            }
        })
        .collect()
}

/// Fills in the noise of channels whose sensor declares none: the standard deviation that explains third
/// differences of the readings, to which smooth motion adds little (Gasser, Sroka and Jennen-Steinmetz
/// 1986 do the same with second ones). Rows of a table are no series: they say no more than the least. Returns the sensors
/// concerned.
pub(crate) fn estimate(
    channels: &mut Channels,
    trials: &[MeasuredTrial],
    options: &CandidateOptions,
) -> Vec<String> {
    let mut estimated = Vec::new();
    let spread = table_spread(channels, trials);
    for source in channels.sources.clone() {
        for component in 0..source.channels {
            let channel: &mut Channel = &mut channels.list[source.channel + component];
            if channel.declared_noise.is_some() {
                continue;
            }
            let mut largest: f64 = 0.0;
            let mut series = Vec::new();
            for trial in trials {
                let readings: Vec<f64> = (0..trial.times.len())
                    .map(|row| {
                        let reading = &trial.row(row)[source.start..source.start + source.len];
                        if source.attitude {
                            let first = &trial.row(0)[source.start..source.start + source.len];
                            rotation_between(first, reading)[component]
                        } else {
                            reading[component]
                        }
                    })
                    .filter(|reading| reading.is_finite())
                    .collect();
                largest = readings.iter().fold(largest, |m, value| m.max(value.abs()));
                // Rows of a table are no series.
                if !trial.steady {
                    series.push(readings);
                }
            }
            let sd = white_noise(&series, 3).unwrap_or(0.0).sqrt();
            channel.noise = (sd.max(options.least_noise * largest.max(1e-3)))
                .max(options.least_table_noise * spread[source.channel + component]);
            if !estimated.contains(&channel.sensor) {
                estimated.push(channel.sensor.clone());
            }
        }
    }
    estimated
}

/// Variance of the white noise that explains the differences of an order of some series, from the median of their squares, which
/// jumps do not move; `None` where there is none.
pub(crate) fn white_noise(series: &[Vec<f64>], order: usize) -> Option<f64> {
    let mut coefficients = vec![1.0];
    for _ in 0..order {
        let last = coefficients.iter().chain([&0.0]);
        let before = [&0.0].into_iter().chain(&coefficients);
        coefficients = last.zip(before).map(|(a, b)| a - b).collect();
    }
    let mut squares: Vec<f64> = (series.iter())
        .flat_map(|of| of.windows(order + 1))
        .map(|values| {
            let terms = values.iter().zip(&coefficients).map(|(of, by)| of * by);
            terms.sum::<f64>().powi(2)
        })
        .filter(|square| square.is_finite())
        .collect();
    squares.sort_by(f64::total_cmp);
    let each: f64 = coefficients.iter().map(|of| of * of).sum();
    // The median of a squared normal is 0.455 of its mean.
    (squares.get(squares.len() / 2)).map(|median| median / 0.455 / each)
}

/// Standard deviation of every channel over the rows of tables of steady states; zero where there are none.
fn table_spread(channels: &Channels, trials: &[MeasuredTrial]) -> Vec<f64> {
    let means = channels::all_means(trials, channels);
    let mut sums = vec![(0.0, 0_usize); channels.len()];
    for (trial, means) in trials.iter().zip(&means).filter(|(trial, _)| trial.steady) {
        for row in 0..trial.times.len() {
            for (channel, (sum, count)) in sums.iter_mut().enumerate() {
                let value = channels::deviation(trial, channels, row, channel, means);
                if value.is_finite() {
                    *sum += value * value;
                    *count += 1;
                }
            }
        }
    }
    (sums.iter())
        .map(|(sum, count)| (sum / (*count).max(1) as f64).sqrt())
        .collect()
}
