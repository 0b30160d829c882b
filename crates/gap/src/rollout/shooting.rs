//! Multiple shooting: a trial is cut into segments, each predicted open loop from its own start.
//!
//! Time follows `mujoco.sysid`: a row labelled t holds the sensors of the state at t less one step;
//! controls are linear between rows and held over a step.

use hydro_effects as effects;
use hydro_effects::{Entry, Part};

use crate::{
    options::RolloutOptions,
    plant::{PlantDescription, Simulation},
    problem::{
        channels::MeasuredTrial,
        segments::{EstimatedMotion, Segment},
    },
};

/// Rows nearer than this part of a step to its start or end read there.
const ON_A_STEP: f64 = 0.01;

/// Readings at every step of a rollout.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trace {
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
    pub(crate) fn known(start: f64, step: f64, width: usize, values: Vec<f64>) -> Self {
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
    pub(crate) fn end(&mut self, step: usize, readings: Vec<f64>) {
        self.ends.push((step, readings));
    }

    /// Readings of the state at a time [s]: linear over a step, continued as a straight line before the
    /// first (a late sensor looks back there).
    pub(crate) fn at(&self, time: f64, reading: &mut [f64]) {
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

    /// The same readings where forces show more of a jump.
    pub(crate) fn with_lead(&self, more: f64) -> Self {
        Self {
            lead: self.lead + more,
            ..self.clone()
        }
    }

    /// Readings just before and just after the command that ends the step in which a time [s] lies; none
    /// where no row reads inside that step.
    pub(crate) fn jump(&self, time: f64) -> Option<(&[f64], &[f64])> {
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

/// Warm-up of a simulation before a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WarmUp {
    /// Seconds of the measured motion that memories are led through.
    pub(crate) seconds: f64,
}

impl WarmUp {
    /// Long where something remembers, none where nothing does.
    pub(crate) fn required(
        model: &PlantDescription,
        entries: &[Entry],
        options: &RolloutOptions,
    ) -> Self {
        let nominal_remembers = model.state_len > 1 + model.nq + model.nv;
        Self {
            seconds: if remembers(entries, model.timestep) {
                options.effect_warm_up
            } else if nominal_remembers {
                options.nominal_warm_up
            } else {
                0.0
            },
        }
    }
}

/// True where effects remember; `step` of the model [s].
pub(crate) fn remembers(entries: &[Entry], step: f64) -> bool {
    entries
        .iter()
        .any(|entry| match effects::effect(entry.effect).part() {
            Part::Body(part) => part.memory_len() > 0,
            Part::Joint(part) => {
                part.memory_len() > 0 || part.backlash(&entry.parameters).is_some()
            }
            Part::Actuator(part) => part.memory_len(&entry.parameters, step) > 0,
            Part::Water(_) | Part::Sensor(_) => false,
        })
}

/// Runs a segment and keeps the readings of every step. False where it blew up.
#[expect(clippy::too_many_arguments)]
pub(crate) fn run(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    segment: &Segment,
    motion: &EstimatedMotion,
    warm_up: WarmUp,
    step: f64,
    tangent: Option<&[f64]>,
    trace: &mut Trace,
) -> bool {
    lead_in(simulation, trial, segment, motion, warm_up, step);
    roll(simulation, trial, segment, step, tangent, trace)
}

/// Runs a segment from its start with whatever memory the simulation has, and keeps the readings of every
/// step; ends [`steps`] steps later. False where it blew up.
pub(crate) fn roll(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    segment: &Segment,
    step: f64,
    tangent: Option<&[f64]>,
    trace: &mut Trace,
) -> bool {
    roll_observed(
        simulation,
        trial,
        segment,
        step,
        tangent,
        0,
        trace,
        &mut |_, _| {},
    )
}

/// As [`roll`], for `least` steps at least; `observe` sees the simulation before every step and after the last.
#[expect(clippy::too_many_arguments)]
pub(crate) fn roll_observed(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    segment: &Segment,
    step: f64,
    tangent: Option<&[f64]>,
    least: usize,
    trace: &mut Trace,
    observe: &mut dyn FnMut(usize, &mut dyn Simulation),
) -> bool {
    let mut control = vec![0.0; trial.control.width()];
    simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
    if let Some(tangent) = tangent {
        simulation.retract(tangent);
    }
    // The one that the simulation had last is of another time.
    trial
        .control
        .interpolate(segment.start - step, &mut control);
    simulation.set_earlier_control(&control);
    trace.start = segment.start;
    trace.step = step;
    trace.width = trial.width;
    trace.values.clear();
    trace.ends.clear();
    trace.lead = simulation.reading_lead();
    let steps = steps(trial, segment.rows.end, segment.start, step).max(least);
    let inside = read_inside(trial, segment, step);
    let mut inside = inside.into_iter().peekable();
    for at in 0..steps {
        let time = segment.start + at as f64 * step;
        observe(at, simulation);
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

/// Steps from a start [s] to what the rows before `end` need: two readings at least, and one at or beyond
/// the last row.
pub(crate) fn steps(trial: &MeasuredTrial, end: usize, start: f64, step: f64) -> usize {
    let last = trial.times[end - 1] - step;
    (((last - start) / step - 1e-6).ceil().max(0.0) as usize).max(1) + 1
}

/// Steps within which a row reads, ascending.
fn read_inside(trial: &MeasuredTrial, segment: &Segment, step: f64) -> Vec<usize> {
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

/// Leads memories through the motion before a segment: states are set to the estimated ones at every row. A steady state has
/// lasted for the whole warm-up. From here on the simulation follows the trial's prescribed motion.
pub(crate) fn lead_in(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    segment: &Segment,
    motion: &EstimatedMotion,
    warm_up: WarmUp,
    step: f64,
) {
    simulation.prescribe(trial.prescribed.clone());
    if trial.steady {
        return stand(simulation, trial, segment, warm_up, step);
    }
    let first_row = motion
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
        hold(simulation, trial, segment, motion, warm_up, step);
    }
    let mut control = vec![0.0; trial.control.width()];
    for row in first_row..motion.times.len() {
        let time = motion.times[row];
        let next = motion
            .times
            .get(row + 1)
            .copied()
            .unwrap_or(f64::INFINITY)
            .min(segment.start);
        if time >= segment.start - 0.5 * step {
            break;
        }
        let (qpos, qvel) = motion.state(row);
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

/// Leads memories through a steady state.
fn stand(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    segment: &Segment,
    warm_up: WarmUp,
    step: f64,
) {
    simulation.reset();
    let mut control = vec![0.0; trial.control.width()];
    trial.control.interpolate(segment.start, &mut control);
    simulation.set_control(&control);
    for _ in 0..(warm_up.seconds / step).round() as usize {
        simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
        simulation.step();
    }
}

/// Before a log begins nothing is known: memories are led through its first motion, held, and the commands that were recorded before it,
/// or a part of the first ones ([`crate::plant::Quantity::CommandsBefore`]).
fn hold(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    segment: &Segment,
    motion: &EstimatedMotion,
    warm_up: WarmUp,
    step: f64,
) {
    let (start, (qpos, qvel)) = match motion.times.first() {
        Some(start) => (*start, motion.state(0)),
        None => (segment.start, (&segment.qpos[..], &segment.qvel[..])),
    };
    let mut control = vec![0.0; trial.control.width()];
    let part = simulation.commands_before();
    let recorded = trial.control.times.first().copied();
    let steps = (warm_up.seconds / step).round() as usize;
    for at in 0..steps {
        let time = start - (steps - at) as f64 * step;
        trial.control.interpolate(time, &mut control);
        if recorded.is_none_or(|first| time < first) {
            control.iter_mut().for_each(|of| *of *= part);
        }
        simulation.set_control(&control);
        simulation.set_motion(time, qpos, qvel);
        simulation.step();
    }
    if let Some(state) = &trial.initial_state {
        simulation.rejoin(state);
    }
}
