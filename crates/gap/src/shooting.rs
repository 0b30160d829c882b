//! Multiple shooting: a trial is cut into segments, each predicted open loop from its own start.
//!
//! Time follows `mujoco.sysid`: a row labelled t holds the sensors of the state at t less one step;
//! controls are linear between rows and held over a step.

use std::ops::Range;

use hydro_effects as effects;
use hydro_effects::{Entry, Part};

use super::measured::{Channels, Measured};
use crate::plant::{PlantDescription, Simulation};

/// Rows nearer than this part of a step to its start or end read there.
const ON_A_STEP: f64 = 0.01;

/// Estimated motion of one trial at the state time of each row.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    /// State times [s].
    pub(super) times: Vec<f64>,
    /// Positions [rows, nq].
    pub(super) qpos: Vec<f64>,
    /// Velocities [rows, nv].
    pub(super) qvel: Vec<f64>,
}

impl Track {
    pub(super) fn motion(&self, row: usize) -> (&[f64], &[f64]) {
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
pub(super) struct Segment {
    /// Which trial.
    pub(super) trial: usize,
    /// Its rows.
    pub(super) rows: Range<usize>,
    /// State time of the start [s].
    pub(super) start: f64,
    /// Positions at the start.
    pub(super) qpos: Vec<f64>,
    /// Velocities at the start.
    pub(super) qvel: Vec<f64>,
}

/// Readings at every step of a rollout.
#[derive(Clone, Debug, Default)]
pub(super) struct Trace {
    start: f64,
    step: f64,
    width: usize,
    values: Vec<f64>,
    /// Readings at the end of some steps, under the command that was held: a force jumps when the command
    /// does. How much of the jump a reading inside the step shows is `lead`.
    ends: Vec<(usize, Vec<f64>)>,
    lead: f64,
}

impl Trace {
    /// One whose readings are known.
    #[cfg(test)]
    pub(super) fn of(start: f64, step: f64, width: usize, values: Vec<f64>) -> Self {
        Self {
            start,
            step,
            width,
            values,
            ends: Vec::new(),
            lead: 0.0,
        }
    }

    /// Readings just before the command that ends a step.
    #[cfg(test)]
    pub(super) fn end(&mut self, step: usize, readings: Vec<f64>) {
        self.ends.push((step, readings));
    }

    /// Readings of the state at a time [s]: linear over a step, continued as a straight line before the
    /// first (a late sensor looks back there).
    pub(super) fn at(&self, time: f64, reading: &mut [f64]) {
        let rows = self.values.len() / self.width.max(1);
        let place = (time - self.start) / self.step;
        let first = (place.floor().max(0.0) as usize).min(rows.saturating_sub(2));
        let part = place - first as f64;
        let a = &self.values[first * self.width..(first + 1) * self.width];
        let next = &self.values[(first + 1) * self.width..(first + 2) * self.width];
        let held = self.held(first).unwrap_or(next);
        for (((value, a), held), next) in reading.iter_mut().zip(a).zip(held).zip(next) {
            *value = a + part * (held - a) + self.lead * (next - held);
        }
    }

    /// Readings just before and just after the command that ends the step in which a time [s] lies; none
    /// where no row reads inside that step.
    pub(super) fn jump(&self, time: f64) -> Option<(&[f64], &[f64])> {
        let step = ((time - self.start) / self.step).floor().max(0.0) as usize;
        let next = self
            .values
            .get((step + 1) * self.width..(step + 2) * self.width)?;
        Some((self.held(step)?, next))
    }

    /// Readings at the end of a step under its command, where they are known.
    fn held(&self, step: usize) -> Option<&[f64]> {
        let found = self.ends.binary_search_by_key(&step, |(step, _)| *step);
        Some(&self.ends[found.ok()?].1)
    }
}

/// What is known of how a simulation has to be warmed up.
#[derive(Clone, Copy, Debug)]
pub(super) struct WarmUp {
    /// Seconds of the measured motion that memories are led through.
    pub(super) seconds: f64,
}

impl WarmUp {
    /// Long where something remembers, none where nothing does.
    pub(super) fn of(model: &PlantDescription, entries: &[Entry]) -> Self {
        let nominal_remembers = model.state_len > 1 + model.nq + model.nv;
        let remembers =
            entries.iter().any(
                |entry| match effects::catalogue::effect(entry.effect).part() {
                    Part::Body(part) => part.memory_len() > 0,
                    Part::Joint(part) => part.memory_len() > 0,
                    Part::Actuator(part) => part.memory_len(&entry.parameters, model.timestep) > 0,
                    Part::Water(_) | Part::Sensor(_) => false,
                },
            );
        Self {
            seconds: if remembers {
                1.0
            } else if nominal_remembers {
                0.25
            } else {
                0.0
            },
        }
    }
}

/// Runs a segment and keeps the readings of every step. False where it blew up.
#[expect(clippy::too_many_arguments)]
pub(super) fn run(
    simulation: &mut dyn Simulation,
    trial: &Measured,
    segment: &Segment,
    track: &Track,
    warm_up: WarmUp,
    step: f64,
    tangent: Option<&[f64]>,
    trace: &mut Trace,
) -> bool {
    lead_in(simulation, trial, segment, track, warm_up, step);
    roll(simulation, trial, segment, step, tangent, trace)
}

/// Runs a segment from its start with whatever memory the simulation has, and keeps the readings of every
/// step; ends [`steps`] steps later. False where it blew up.
pub(super) fn roll(
    simulation: &mut dyn Simulation,
    trial: &Measured,
    segment: &Segment,
    step: f64,
    tangent: Option<&[f64]>,
    trace: &mut Trace,
) -> bool {
    let mut control = vec![0.0; trial.control.width()];
    simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
    if let Some(tangent) = tangent {
        simulation.retract(tangent);
    }
    trace.start = segment.start;
    trace.step = step;
    trace.width = trial.width;
    trace.values.clear();
    trace.ends.clear();
    trace.lead = simulation.reading_lead();
    let steps = steps(trial, segment.rows.end, segment.start, step);
    let inside = read_inside(trial, segment, step);
    let mut inside = inside.into_iter().peekable();
    for at in 0..steps {
        let time = segment.start + at as f64 * step;
        trial.control.interpolate(time, &mut control);
        simulation.set_control(&control);
        simulation.step();
        trace
            .values
            .extend_from_slice(&simulation.sensors()[..trial.width]);
        if inside.next_if_eq(&at).is_some() {
            simulation.look();
            let reading = simulation.sensors()[..trial.width].to_vec();
            trace.ends.push((at, reading));
        }
    }
    let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
    !simulation.diverged()
        && finite(&trace.values)
        && trace.ends.iter().all(|(_, values)| finite(values))
}

/// Row behind the last of a window that begins at a row and lasts about `length` seconds; a rest too short
/// for a window of its own joins it.
pub(super) fn window_end(trial: &Measured, first: usize, length: f64, least_rows: usize) -> usize {
    let rows = trial.times.len();
    let end = trial
        .times
        .partition_point(|time| *time < trial.times[first] + length - 1e-9)
        .max(first + least_rows);
    if end + least_rows > rows { rows } else { end }
}

/// Steps from a start [s] to what the rows before `end` need: two readings at least, and one at or beyond
/// the last row.
pub(super) fn steps(trial: &Measured, end: usize, start: f64, step: f64) -> usize {
    let last = trial.times[end - 1] - step;
    (((last - start) / step - 1e-6).ceil().max(0.0) as usize).max(1) + 1
}

/// Steps within which a row reads, ascending.
fn read_inside(trial: &Measured, segment: &Segment, step: f64) -> Vec<usize> {
    let places = segment.rows.clone().map(|row| {
        let place = (trial.times[row] - step - segment.start) / step;
        (place, place - place.floor())
    });
    let mut inside: Vec<usize> = places
        .filter(|(place, part)| *place > 0.0 && (ON_A_STEP..1.0 - ON_A_STEP).contains(part))
        .map(|(place, _)| place.floor() as usize)
        .collect();
    inside.sort_unstable();
    inside.dedup();
    inside
}

/// Leads memories through the motion before a segment: states are set to the estimated ones at every row.
pub(super) fn lead_in(
    simulation: &mut dyn Simulation,
    trial: &Measured,
    segment: &Segment,
    track: &Track,
    warm_up: WarmUp,
    step: f64,
) {
    let first_row = track
        .times
        .partition_point(|time| *time < segment.start - warm_up.seconds);
    let from_the_beginning = first_row == 0;
    match &trial.initial_state {
        Some(state) if from_the_beginning => simulation.restart(state),
        _ => simulation.reset(),
    }
    if warm_up.seconds <= 0.0 {
        return;
    }
    if from_the_beginning {
        hold(simulation, trial, segment, track, warm_up, step);
    }
    let mut control = vec![0.0; trial.control.width()];
    for row in first_row..track.times.len() {
        let time = track.times[row];
        let next = track
            .times
            .get(row + 1)
            .copied()
            .unwrap_or(f64::INFINITY)
            .min(segment.start);
        if time >= segment.start - 0.5 * step {
            break;
        }
        let (qpos, qvel) = track.motion(row);
        simulation.set_motion(time, qpos, qvel);
        let steps = ((next - time) / step).round() as usize;
        for at in 0..steps {
            trial
                .control
                .interpolate(time + at as f64 * step, &mut control);
            simulation.set_control(&control);
            simulation.step();
        }
    }
}

/// Before a log begins nothing is known: memories are led through its first motion and command, held.
fn hold(
    simulation: &mut dyn Simulation,
    trial: &Measured,
    segment: &Segment,
    track: &Track,
    warm_up: WarmUp,
    step: f64,
) {
    let (start, (qpos, qvel)) = match track.times.first() {
        Some(start) => (*start, track.motion(0)),
        None => (segment.start, (&segment.qpos[..], &segment.qvel[..])),
    };
    let mut control = vec![0.0; trial.control.width()];
    trial.control.interpolate(start, &mut control);
    simulation.set_control(&control);
    let steps = (warm_up.seconds / step).round() as usize;
    for at in 0..steps {
        simulation.set_motion(start - (steps - at) as f64 * step, qpos, qvel);
        simulation.step();
    }
    if let Some(state) = &trial.initial_state {
        simulation.rejoin(state);
    }
}

/// Correction of one sensor of the measurement: scale, delay [s], bias by channel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Correction {
    pub(super) scale: f64,
    pub(super) delay: f64,
    pub(super) bias: [f64; 3],
}

impl Correction {
    pub(super) const NONE: Self = Self {
        scale: 1.0,
        delay: 0.0,
        bias: [0.0; 3],
    };
}

/// Corrections by sensor of the model.
pub(super) fn corrections(model: &PlantDescription, entries: &[Entry]) -> Vec<Correction> {
    let mut all = vec![Correction::NONE; model.sensors.len()];
    for entry in entries {
        let Part::Sensor(part) = effects::catalogue::effect(entry.effect).part() else {
            continue;
        };
        let Some(at) = model
            .sensors
            .iter()
            .position(|sensor| sensor.name == entry.target)
        else {
            continue;
        };
        let correction = &mut all[at];
        correction.scale *= part.scale(&entry.parameters);
        correction.delay += part.delay(&entry.parameters);
        for (component, bias) in correction.bias.iter_mut().enumerate() {
            *bias += part.bias(&entry.parameters, component);
        }
    }
    all
}

/// Residuals of a segment, row by row, channel by channel, in the units of the channels; NaN where there
/// is no reading.
pub(super) fn residuals(
    trace: &Trace,
    trial: &Measured,
    segment: &Segment,
    channels: &Channels,
    corrections: &[Correction],
    step: f64,
    residuals: &mut Vec<f64>,
) {
    residuals.clear();
    let mut reading = vec![0.0; trial.width];
    let mut late = vec![0.0; trial.width];
    let mut row_residual = vec![0.0; channels.len()];
    for row in segment.rows.clone() {
        let time = trial.times[row] - step;
        trace.at(time, &mut reading);
        for source in &channels.sources {
            let correction = &corrections[source.sensor];
            if *correction == Correction::NONE {
                continue;
            }
            let range = source.start..source.start + source.len;
            if correction.delay != 0.0 {
                trace.at(time - correction.delay, &mut late);
                reading[range.clone()].copy_from_slice(&late[range.clone()]);
            }
            if !source.attitude {
                for (component, value) in reading[range].iter_mut().enumerate() {
                    *value = *value * correction.scale + correction.bias[component.min(2)];
                }
            }
        }
        channels.residual(trial.row(row), &reading, &mut row_residual);
        for source in channels.sources.iter().filter(|source| source.attitude) {
            let bias = corrections[source.sensor].bias;
            for (value, bias) in row_residual[source.channel..].iter_mut().zip(bias) {
                *value -= bias;
            }
        }
        residuals.extend_from_slice(&row_residual);
    }
}

/// Cuts a trial into segments of about `length` seconds along its track.
pub(super) fn cut(
    index: usize,
    trial: &Measured,
    track: &Track,
    length: f64,
    least_rows: usize,
) -> Vec<Segment> {
    let mut segments = Vec::new();
    let rows = trial.times.len();
    let mut first = 0;
    while first < rows {
        let mut end = trial
            .times
            .partition_point(|time| *time < trial.times[first] + length - 1e-9);
        end = end.max(first + least_rows).min(rows);
        // A short rest joins the last segment.
        if trial.times[rows - 1] - trial.times[end.min(rows - 1)] < 0.5 * length {
            end = rows;
        }
        if end - first >= least_rows {
            let (qpos, qvel) = track.motion(first);
            segments.push(Segment {
                trial: index,
                rows: first..end,
                start: track.times[first],
                qpos: qpos.to_vec(),
                qvel: qvel.to_vec(),
            });
        }
        first = end;
    }
    segments
}
