//! How noisy residuals are, and what structure is left in them.

use super::bench::Bench;

/// An autocorrelation below this ends the sum.
const NEGLIGIBLE: f64 = 0.05;
/// Rows of lag at most.
const LONGEST: usize = 50;

/// Variance and correlation of one channel's whitened residuals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leftover {
    /// Mean square; 1 where the noise is as declared.
    pub(super) variance: f64,
    /// Integrated autocorrelation time in rows; 1 for white noise.
    pub(super) time: f64,
    /// Readings.
    pub(super) count: usize,
}

/// Of every channel, over all segments.
pub(super) fn by_channel(bench: &Bench<'_>, residuals: &[Vec<f64>]) -> Vec<Leftover> {
    let width = bench.channels.len();
    (0..width)
        .map(|channel| {
            let series: Vec<Vec<f64>> = residuals
                .iter()
                .map(|segment| {
                    segment
                        .iter()
                        .skip(channel)
                        .step_by(width)
                        .copied()
                        .collect()
                })
                .collect();
            of(&series)
        })
        .collect()
}

fn of(series: &[Vec<f64>]) -> Leftover {
    let present = |value: &f64| *value != 0.0;
    let count = series
        .iter()
        .flatten()
        .filter(|value| present(value))
        .count();
    let variance = series
        .iter()
        .flatten()
        .map(|value| value * value)
        .sum::<f64>()
        / count.max(1) as f64;
    let mut time = 1.0;
    for lag in 1..LONGEST {
        let (mut sum, mut pairs) = (0.0, 0_usize);
        for segment in series {
            for (a, b) in segment.iter().zip(segment.iter().skip(lag)) {
                if present(a) && present(b) {
                    sum += a * b;
                    pairs += 1;
                }
            }
        }
        let correlation = sum / pairs.max(1) as f64 / variance.max(f64::MIN_POSITIVE);
        if pairs == 0 || correlation < NEGLIGIBLE {
            break;
        }
        time += 2.0 * correlation;
    }
    Leftover {
        variance,
        time,
        count,
    }
}

/// By how much squared whitened residuals overstate what they say: variance beyond the declared noise
/// times correlation, averaged over the channels that hold readings. One at least.
pub(super) fn overstatement(leftovers: &[Leftover]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for leftover in leftovers.iter().filter(|leftover| leftover.count > 0) {
        sum += leftover.variance * leftover.time;
        count += 1;
    }
    (sum / count.max(1) as f64).max(1.0)
}
