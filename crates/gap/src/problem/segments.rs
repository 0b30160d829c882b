//! The estimated motion of a trial, and the segments that it is cut into.

use std::ops::Range;

use crate::problem::channels::MeasuredTrial;

/// Estimated motion of one trial at the state time of each row.
#[derive(Clone, Debug, Default)]
pub(crate) struct EstimatedMotion {
    /// State times [s].
    pub(crate) times: Vec<f64>,
    /// Positions [rows, nq].
    pub(crate) qpos: Vec<f64>,
    /// Velocities [rows, nv].
    pub(crate) qvel: Vec<f64>,
}

impl EstimatedMotion {
    pub(crate) fn state(&self, row: usize) -> (&[f64], &[f64]) {
        let (nq, nv) = (
            self.qpos.len() / self.times.len(),
            self.qvel.len() / self.times.len(),
        );
        (
            &self.qpos[row * nq..(row + 1) * nq],
            &self.qvel[row * nv..(row + 1) * nv],
        )
    }
}

/// A stretch of a trial that is predicted in one go.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    /// Its rows.
    pub(crate) rows: Range<usize>,
    /// State time of the start [s].
    pub(crate) start: f64,
    /// Positions at the start.
    pub(crate) qpos: Vec<f64>,
    /// Velocities at the start.
    pub(crate) qvel: Vec<f64>,
}

impl Segment {
    /// Rows along a motion, from the state of the first.
    pub(crate) fn at(motion: &EstimatedMotion, rows: Range<usize>) -> Self {
        let (qpos, qvel) = motion.state(rows.start);
        Self {
            start: motion.times[rows.start],
            qpos: qpos.to_vec(),
            qvel: qvel.to_vec(),
            rows,
        }
    }
}

/// Row behind the last of a window that begins at a row and lasts about `length` seconds; a rest too short
/// for a window of its own joins it.
pub(crate) fn window_end(
    trial: &MeasuredTrial,
    first: usize,
    length: f64,
    least_rows: usize,
) -> usize {
    let rows = trial.times.len();
    let end = trial
        .times
        .partition_point(|time| *time < trial.times[first] + length - 1e-9)
        .max(first + least_rows);
    if end + least_rows > rows { rows } else { end }
}

/// Cuts the first `rows` of a trial into segments of about `length` seconds and at least `least_rows` along its motion. A rest
/// shorter than a part `joined` of a segment joins the last one. Every steady state is a segment of its own.
pub(crate) fn cut(
    trial: &MeasuredTrial,
    motion: &EstimatedMotion,
    rows: usize,
    [length, joined]: [f64; 2],
    least_rows: usize,
) -> Vec<Segment> {
    let mut segments = Vec::new();
    if trial.steady {
        return (0..rows)
            .map(|row| Segment::at(motion, row..row + 1))
            .collect();
    }
    let mut first = 0;
    while first < rows {
        let mut end = trial
            .times
            .partition_point(|time| *time < trial.times[first] + length - 1e-9);
        end = end.max(first + least_rows).min(rows);
        let rest = trial.times[rows - 1] - trial.times[end.min(rows - 1)];
        if rest < joined * length {
            end = rows;
        }
        if end - first >= least_rows {
            segments.push(Segment::at(motion, first..end));
        }
        first = end;
    }
    segments
}
