//! Weights for what rows cannot resolve: readings that bend within a sample period count less.
//!
//! Between two rows a log knows nothing: commands are taken to be linear there, anti-alias filters (first
//! order, time constant tau, their delay known) round corners off by `tau^2/2 y''`, clocks jitter. With a
//! corner at a quarter of the rate, tau is 0.64 of a period, so the error is about a fifth of the second
//! difference of neighbouring rows. It joins the sensor's noise.
//!
//! A force jumps with a held command, and when within a step the real one changed is not known: a row that
//! reads inside a step may be off by the jump, with the deviation of an even spread over the step. That all such rows
//! may be off alike is an uncertain number of its own, the forces' lead.

use crate::{
    problem::{
        channels::{Channels, MeasuredTrial},
        segments::Segment,
    },
    rollout::shooting::Trace,
};

/// Standard deviation of an even spread over one: the part of a jump by which a row inside a step is off.
const EVEN: f64 = 0.288_675;

/// Factor on each whitened residual of a segment, row by row, channel by channel; 1 where the reading is
/// smooth.
pub(crate) fn weights(
    trace: &Trace,
    trial: &MeasuredTrial,
    segment: &Segment,
    channels: &Channels,
    step: f64,
    unresolved: f64,
) -> Vec<f64> {
    if trial.steady {
        return stated(trial, segment, channels);
    }
    let period = trial.period();
    let mut readings = [(); 3].map(|()| vec![0.0; trial.width]);
    let (mut onward, mut back) = (vec![0.0; channels.len()], vec![0.0; channels.len()]);
    let mut jump = vec![0.0; channels.len()];
    let mut weights = Vec::with_capacity(segment.rows.len() * channels.len());
    for row in segment.rows.clone() {
        for (reading, shift) in readings.iter_mut().zip([-period, 0.0, period]) {
            trace.at(trial.times[row] - step + shift, reading);
        }
        channels.residual(&readings[2], &readings[1], &mut onward);
        channels.residual(&readings[0], &readings[1], &mut back);
        match trace.jump(trial.times[row] - step) {
            Some((before, after)) => channels.residual(after, before, &mut jump),
            None => jump.fill(0.0),
        }
        let errors = onward.iter().zip(&back).zip(&jump).zip(&channels.list);
        for (((onward, back), jump), channel) in errors {
            let bend = unresolved * (onward + back) / channel.noise;
            let jump = EVEN * jump / channel.noise;
            let weight = (1.0 + bend * bend + jump * jump).sqrt().recip();
            weights.push(if weight.is_finite() { weight } else { 1.0 });
        }
    }
    weights
}

/// Weights of steady states: the channel's noise over the standard deviation that the table gives the reading.
fn stated(trial: &MeasuredTrial, segment: &Segment, channels: &Channels) -> Vec<f64> {
    let mut weights = vec![1.0; segment.rows.len() * channels.len()];
    for (at, row) in segment.rows.clone().enumerate() {
        for source in channels.sources.iter().filter(|of| !of.attitude) {
            for component in 0..source.channels {
                let place = row * trial.width + source.start + component;
                let channel = source.channel + component;
                let stated = trial.deviations.get(place).copied().unwrap_or(f64::NAN);
                let weight = channels.list[channel].noise / stated;
                if weight.is_finite() {
                    weights[at * channels.len() + channel] = weight;
                }
            }
        }
    }
    weights
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// One reading every 0.01 s of a trace with a step of 0.001 s.
    fn case(signal: impl Fn(f64) -> f64) -> (Trace, MeasuredTrial, Segment, Channels) {
        let times: Vec<f64> = (1..=50).map(|row| 0.01 * f64::from(row)).collect();
        let trial = MeasuredTrial {
            name: String::new(),
            values: times.clone(),
            times,
            width: 1,
            ..MeasuredTrial::default()
        };
        let segment = Segment {
            rows: 0..50,
            start: 0.0,
            qpos: vec![],
            qvel: vec![],
        };
        let channels = Channels::single(0.1);
        let values = (0..520).map(|at| signal(0.001 * f64::from(at))).collect();
        (
            Trace::known(0.0, 0.001, 1, values),
            trial,
            segment,
            channels,
        )
    }

    fn weights_of(signal: impl Fn(f64) -> f64) -> Vec<f64> {
        let (trace, trial, segment, channels) = case(signal);
        weights(&trace, &trial, &segment, &channels, 0.001, 0.25)
    }

    #[test]
    fn a_smooth_reading_counts_in_full_and_a_corner_less() {
        let smooth = weights_of(|time| (6.0 * time).sin());
        assert!(smooth.iter().all(|weight| *weight > 0.999), "{smooth:?}");
        let jump = weights_of(|time| f64::from(u8::from(time > 0.2505)));
        assert!(
            jump.iter().fold(1.0_f64, |a, b| a.min(*b)) < 0.5,
            "{jump:?}"
        );
        let full = jump.iter().filter(|weight| **weight > 0.999).count();
        assert!(full >= 47, "{jump:?}");
    }

    /// A jump of one at the end of the step in which the tenth row reads: 0.289 of ten noises beside the one.
    #[test]
    fn a_row_inside_a_step_that_ends_in_a_jump_counts_less() {
        let (mut trace, trial, segment, channels) = case(|_| 0.0);
        let step = ((trial.times[9] - 0.001) / 0.001).floor() as usize;
        trace.end(step, vec![-1.0]);
        let found = weights(&trace, &trial, &segment, &channels, 0.001, 0.25);
        let expected = (1.0 + (0.289 / 0.1_f64).powi(2)).sqrt().recip();
        assert!((found[9] - expected).abs() < 0.01, "{found:?}");
        assert!(found[8] > 0.999 && found[10] > 0.999, "{found:?}");
    }
}
