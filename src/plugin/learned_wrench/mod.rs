//! A checkpoint's force on a model, a wrench on one body and torques on joints: a state slice in, a force out.
//!
//! ```text
//! state       the memory, number by number
//! moment      time and state of the model
//! force       a wrench and torques, and where a card's outputs act
//! cold_start  the first sample of a run, from `compute` to `advance`
//! network     the network, held to its training range
//! notice      what a user is told
//! ```
//!
//! All memory is in the state slice; a [`LearnedWrench`] is immutable. The force between two samples is the linear
//! interpolation of the forces at them, so [`LearnedWrench::force`] is pure and right at every stage of every
//! integrator; [`LearnedWrench::advance`] alone evaluates the network, once a sample. Where the clock was moved by
//! hand, or the state was replaced without the plugin's, the run starts anew from there.

mod cold_start;
mod force;
mod moment;
mod network;
mod notice;
mod state;

use std::{cell::RefCell, sync::Arc};

use hydro_model::{Engine, Scratch, checkpoint::Checkpoint};

use self::{
    cold_start::{Place, Start},
    force::{Place as OutputPlace, output_places},
    moment::finite,
    network::{Forces, Network, NotFinite},
    notice::density_notice,
    state::{FORCES, OUT_OF_RANGE, Phase, SAMPLE_TIME, SAMPLES, STEP_TIME, place},
};
pub use self::{force::LearnedForce, moment::Moment, notice::Notice, state::state_len};
use super::{
    attributes::{InitialForce, Settings},
    body::{Body, BodyError},
    feature_map::FeatureMap,
};

/// Largest distance of a step from a sample that still counts as on it, as a part of the sample period.
const ON_SAMPLE: f64 = 1e-6;

/// Largest drift of the clock before it counts as moved by hand, as a part of the step.
const SAME_CLOCK: f64 = 1e-3;

/// Samples that one step may span; a longer jump starts anew.
const MOST_SAMPLES_A_STEP: usize = 1000;

/// Settings, features and network, tied to one model.
#[derive(Debug)]
pub struct LearnedWrench {
    settings: Settings,
    features: FeatureMap,
    network: Network,
    /// Where each output acts [f].
    places: Vec<OutputPlace>,
    sample_period: f64,
    /// True where the wrench acts beside another model of the water.
    residual: bool,
    density_notice: Option<Notice>,
    control_notice: Option<Notice>,
}

/// Working memory a thread: two samples, forces and the engine's own.
#[derive(Default)]
struct Workspace {
    sample: Vec<f64>,
    between: Vec<f64>,
    carried: Vec<f64>,
    scratch: Scratch,
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

impl LearnedWrench {
    /// Ties a checkpoint to a model's body.
    pub fn new(
        settings: Settings,
        checkpoint: &Checkpoint,
        engine: Arc<dyn Engine>,
        body: &Body,
    ) -> Result<Self, BodyError> {
        let card = &checkpoint.card;
        let features = FeatureMap::new(
            &card.features,
            &card.joints,
            settings.joints.as_deref(),
            body,
            settings.density,
            settings.current,
        )?;
        let names = (&card.joints[..], settings.joints.as_deref());
        let places = output_places(&card.outputs, settings.outputs, names, body)?;
        if let InitialForce::Given(force) = &settings.initial_force
            && force.len() != places.len()
        {
            return Err(BodyError::InitialForce {
                found: force.len(),
                outputs: card.outputs.clone(),
            });
        }
        let density_notice = density_notice(card, settings.density);
        Ok(Self {
            settings,
            features,
            network: Network::new(engine, card),
            places,
            sample_period: card.sample_period,
            residual: card.residual,
            density_notice,
            control_notice: card
                .model
                .needs_the_future()
                .then_some(Notice::ControlReplaced),
        })
    }

    /// The checked attributes.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The card's features, tied to this model.
    pub fn features(&self) -> &FeatureMap {
        &self.features
    }

    /// Sample period of the model [s].
    pub fn sample_period(&self) -> f64 {
        self.sample_period
    }

    /// Length of the state slice.
    pub fn state_len(&self) -> usize {
        state_len(&*self.network.engine)
    }

    /// Forgets everything: the next force is that of a cold start.
    pub fn reset(state: &mut [f64]) {
        state.fill(0.0);
        cold_start::take(place(state));
    }

    /// True where a state slice holds no memory yet.
    pub fn is_cold(state: &[f64]) -> bool {
        Phase::read(state) == Phase::Cold
    }

    /// Warnings when a model is loaded; `native_fluid`: MuJoCo's own fluid acts.
    pub fn notices_at_load(&self, native_fluid: bool) -> impl Iterator<Item = Notice> {
        (native_fluid && !self.residual)
            .then_some(Notice::FluidCountedTwice)
            .into_iter()
            .chain(self.density_notice.clone())
            .chain(self.control_notice.clone())
    }

    /// The force at a moment, of a fully submerged robot; changes nothing. Zero where the moment is no
    /// number, though only a step's end makes that a fault.
    pub fn force(&self, state: &[f64], moment: Moment<'_>) -> LearnedForce {
        if state.len() != self.state_len()
            || Phase::read(state) == Phase::Faulted
            || !moment.is_finite()
        {
            return LearnedForce::default();
        }
        let outputs = self.places.len();
        if Phase::read(state) == Phase::Warm && within_step(state[STEP_TIME], moment) {
            let (forces, rest) = state[FORCES..].split_at(2 * outputs);
            let (now, next) = forces.split_at(outputs);
            return self.between(state[SAMPLE_TIME], now, next, &rest[..outputs], moment.time);
        }
        // Cold: what the first sample gives. Inner stages belong to the step's first one.
        let place = place(state);
        let inner = |start: &Start| {
            (moment.runge_kutta
                && cold_start::is_inner_stage(start.time, moment.time, moment.timestep))
            .then(|| self.after(start, moment.time))
        };
        if let Some(force) = cold_start::with(place, inner).flatten() {
            return force;
        }
        match self.first_sample(place, moment) {
            Some(start) => {
                let force = self.after(&start, moment.time);
                cold_start::remember(place, start);
                force
            }
            None => LearnedForce::default(),
        }
    }

    /// Takes the samples that the step to `moment` reached, and evaluates the network at each.
    pub fn advance(&self, state: &mut [f64], moment: Moment<'_>) -> Option<Notice> {
        if state.len() != self.state_len() || Phase::read(state) == Phase::Faulted {
            return None;
        }
        if !moment.is_finite() {
            return Some(self.fault(state));
        }
        let began = moment.time - moment.timestep;
        let slack = SAME_CLOCK * moment.timestep;
        if Phase::read(state) == Phase::Cold || (state[STEP_TIME] - began).abs() > slack {
            let noted = cold_start::take(place(state));
            let start = noted.filter(|start| (start.time - began).abs() <= slack);
            // Without a note (passive forces are off, say) the run starts where this step ended.
            let start = start.or_else(|| self.first_sample(place(state), moment));
            match start {
                Some(start) => self.begin(state, &start),
                None => return Some(self.fault(state)),
            }
        }
        self.follow(state, moment)
    }

    /// As [`Self::advance`], for a MuJoCo without a hook at a step's end: the present state counts as that of the step's end.
    ///
    /// The first call after a reset is a cold start; a second one at the same time starts again, for a
    /// simulation is often moved before its first step.
    pub fn follow_clock(&self, state: &mut [f64], moment: Moment<'_>) -> Option<Notice> {
        if state.len() != self.state_len() || Phase::read(state) == Phase::Faulted {
            return None;
        }
        if !moment.is_finite() {
            return Some(self.fault(state));
        }
        let slack = SAME_CLOCK * moment.timestep;
        let elapsed = moment.time - state[STEP_TIME];
        let untouched = state[SAMPLES] == 1.0 && state[STEP_TIME] == state[SAMPLE_TIME];
        if Phase::read(state) == Phase::Warm && elapsed == 0.0 && !untouched {
            return None;
        }
        if Phase::read(state) == Phase::Warm && elapsed > 0.0 && elapsed <= moment.timestep + slack
        {
            return self.follow(state, moment);
        }
        match self.first_sample(place(state), moment) {
            Some(start) => {
                self.begin(state, &start);
                None
            }
            None => Some(self.fault(state)),
        }
    }

    fn fault(&self, state: &mut [f64]) -> Notice {
        Phase::Faulted.write(state);
        Notice::NotFinite
    }

    /// The cold start of a moment, or `None` where its features or its forces are not finite.
    fn first_sample(&self, place: Place, moment: Moment<'_>) -> Option<Start> {
        let (inputs, outputs) = (self.features.len(), self.places.len());
        let mut sample = vec![0.0; inputs];
        self.features
            .sample(moment.qpos, moment.qvel, moment.water, None, &mut sample);
        if !finite(&sample) {
            return None;
        }
        // `mj_forward` on a resting state, or a sensor after the passive force: the same again.
        let same = |start: &Start| (start.sample == sample).then(|| start.clone());
        if let Some(mut start) = cold_start::with(place, same).flatten() {
            start.time = moment.time;
            return Some(start);
        }
        let mut carried = vec![0.0; outputs];
        let mut start = Start {
            time: moment.time,
            sample,
            now: vec![0.0; outputs],
            next: vec![0.0; outputs],
            drag: vec![0.0; outputs],
        };
        let forces = Forces {
            now: &mut start.now,
            next: &mut start.next,
            drag: &mut start.drag,
        };
        let initial = &self.settings.initial_force;
        let found = WORKSPACE.with_borrow_mut(|work| {
            let scratch = &mut work.scratch;
            self.network
                .first(&start.sample, initial, &mut carried, forces, scratch)
        });
        found.ok().map(|()| start)
    }

    fn begin(&self, state: &mut [f64], start: &Start) {
        Phase::Warm.write(state);
        state[SAMPLES] = 1.0;
        state[SAMPLE_TIME] = start.time;
        state[STEP_TIME] = start.time;
        state[OUT_OF_RANGE] = 0.0;
        let mut rest = &mut state[FORCES..];
        for part in [&start.now, &start.next, &start.drag, &start.sample] {
            let (slot, after) = rest.split_at_mut(part.len());
            slot.copy_from_slice(part);
            rest = after;
        }
        WORKSPACE.with_borrow_mut(|work| {
            self.network
                .start(&start.sample, &start.now, rest, &mut work.scratch);
        });
    }

    /// Takes the samples between the latest step's end and `moment`.
    fn follow(&self, state: &mut [f64], moment: Moment<'_>) -> Option<Notice> {
        let (inputs, outputs) = (self.features.len(), self.places.len());
        WORKSPACE.with_borrow_mut(|work| {
            let Workspace {
                sample,
                between,
                carried,
                scratch,
            } = work;
            sample.resize(inputs, 0.0);
            between.resize(inputs, 0.0);
            carried.resize(outputs, 0.0);
            let mut notice = None;
            let previous = Some(&state[FORCES + 3 * outputs..][..inputs]);
            self.features
                .sample(moment.qpos, moment.qvel, moment.water, previous, sample);
            if !finite(sample) {
                return Some(self.fault(state));
            }
            for _ in 0..MOST_SAMPLES_A_STEP {
                let due = state[SAMPLE_TIME] + self.sample_period;
                let late = moment.time - due;
                let tolerance = ON_SAMPLE * self.sample_period;
                if late < -tolerance {
                    break;
                }
                let before = state[STEP_TIME];
                let (head, rest) = state.split_at_mut(FORCES);
                let (forces, rest) = rest.split_at_mut(2 * outputs);
                let (drag, rest) = rest.split_at_mut(outputs);
                let (previous, memory) = rest.split_at_mut(inputs);
                // On the sample its time is the simulation's own, so that rounding never piles up.
                if late <= tolerance {
                    head[SAMPLE_TIME] = moment.time;
                    between.copy_from_slice(sample);
                } else {
                    head[SAMPLE_TIME] = due;
                    let fraction = (due - before) / (moment.time - before);
                    self.features.between(previous, sample, fraction, between);
                    // A step that does not divide the period misses the first sample after a start
                    // already.
                    if head[SAMPLES] == 1.0 {
                        notice = Some(Notice::StepDoesNotDivide);
                    }
                }
                head[SAMPLES] += 1.0;
                if head[OUT_OF_RANGE] == 0.0
                    && notice.is_none()
                    && let Some(excess) = self.network.excess(between)
                {
                    head[OUT_OF_RANGE] = 1.0;
                    notice = Some(Notice::OutOfRange(excess));
                }
                let (now, next) = forces.split_at_mut(outputs);
                carried.copy_from_slice(next);
                let forces = Forces { now, next, drag };
                if let Err(NotFinite) = self.network.next(between, memory, carried, forces, scratch)
                {
                    return Some(self.fault(state));
                }
            }
            state[STEP_TIME] = moment.time;
            let previous = FORCES + 3 * outputs;
            state[previous..previous + inputs].copy_from_slice(sample);
            notice
        })
    }

    /// The force at `time`, after a cold start.
    fn after(&self, start: &Start, time: f64) -> LearnedForce {
        self.between(start.time, &start.now, &start.next, &start.drag, time)
    }

    /// The force at `time`, between the forces at two samples [f], with the drag [f] at the first. Here alone `wrench_scale`
    /// counts: what the network carries from sample to sample is its own.
    fn between(
        &self,
        sample_time: f64,
        now: &[f64],
        next: &[f64],
        drag: &[f64],
        time: f64,
    ) -> LearnedForce {
        let fraction = ((time - sample_time) / self.sample_period).clamp(0.0, 1.0);
        let at =
            |output: usize| now[output] + fraction * (next[output] - now[output]) + drag[output];
        LearnedForce::of(&self.places, &self.settings.wrench_scale, at)
    }
}

/// True where `moment` lies in the step that began at `began`, or at its ends.
fn within_step(began: f64, moment: Moment<'_>) -> bool {
    let slack = SAME_CLOCK * moment.timestep;
    (began - slack..=began + moment.timestep + slack).contains(&moment.time)
}

#[cfg(test)]
mod tests;
