//! Variance and autocorrelation time of the whitened residuals, by channel.

use crate::options::DiscrepancyOptions;

/// Variance and correlation of one channel's whitened residuals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Autocorrelation {
    /// Mean square; 1 where the noise is as declared.
    pub(crate) variance: f64,
    /// Integrated autocorrelation time in rows; 1 for white noise.
    pub(crate) time: f64,
    /// Readings.
    pub(crate) count: usize,
}

/// Variance and autocorrelation time of every channel, over all segments. `width`: channels.
pub(crate) fn by_channel(
    width: usize,
    options: &DiscrepancyOptions,
    residuals: &[Vec<f64>],
) -> Vec<Autocorrelation> {
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
            autocorrelation(&series, options)
        })
        .collect()
}

fn autocorrelation(series: &[Vec<f64>], options: &DiscrepancyOptions) -> Autocorrelation {
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
    for lag in 1..options.longest_lag {
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
        if pairs == 0 || correlation < options.negligible_autocorrelation {
            break;
        }
        time += 2.0 * correlation;
    }
    Autocorrelation {
        variance,
        time,
        count,
    }
}

/// Variance times autocorrelation time, the mean over channels that hold readings: the factor by which squared whitened
/// residuals overstate their information. One at least.
pub(crate) fn noise_inflation(autocorrelations: &[Autocorrelation]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for autocorrelation in autocorrelations
        .iter()
        .filter(|autocorrelation| autocorrelation.count > 0)
    {
        sum += autocorrelation.variance * autocorrelation.time;
        count += 1;
    }
    (sum / count.max(1) as f64).max(1.0)
}
