//! Slow drifts of sensors that declare no noise: in what their readings move, linear between the starts of segments, an
//! autoregression from start to start (the error of a camera's calibration as a body crosses the picture, say).

use nalgebra::DMatrix;

use crate::{likelihood::track::Track, problem::problem::Problem};

/// Puts in the columns of the drifts of one segment from column `first` on: at its start, then at the next one's.
pub(super) fn put(
    problem: &Problem<'_>,
    track: &Track,
    at: usize,
    first: usize,
    outputs: &mut DMatrix<f64>,
) {
    let link = &track.links[at];
    let times = &problem.trials[track.trial].times;
    let begin = times[link.segment.rows.start];
    let seconds = link.steps.max(1) as f64 * problem.model.timestep;
    for (number, row) in link.segment.rows.clone().enumerate() {
        let part = ((times[row] - begin) / seconds).clamp(0.0, 1.0);
        for (channel, of) in problem.drifting.iter().enumerate() {
            let out = number * problem.channels.len() + of.channel;
            outputs[(out, first + channel)] = of.scale * (1.0 - part);
            outputs[(out, first + problem.drifting.len() + channel)] = of.scale * part;
        }
    }
}
