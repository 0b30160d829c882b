//! One plugin instance: a state slice in, a wrench out.
//!
//! All memory is in the state slice, which MuJoCo copies, saves and restores; this struct is immutable.
//! For n features, f outputs and an engine with M numbers of memory the slice holds
//!
//! | offset | numbers | meaning |
//! |---|---|---|
//! | 0 | 1 | phase: 0 cold, 1 warm, 2 faulted |
//! | 1 | 1 | samples taken since the start |
//! | 2 | 1 | time of the latest sample [s] |
//! | 3 | 1 | time of the latest step's end [s] |
//! | 4 | 1 | 1 once a velocity was out of the network's range, else 0 |
//! | 5 | f | force at the latest sample [N, N m] |
//! | 5 + f | f | force one sample period later |
//! | 5 + 2f | f | drag of the velocities at the latest sample that are out of the network's range |
//! | 5 + 3f | n | features at the latest step's end |
//! | 5 + 3f + n | M | the engine's memory of what came before |
//!
//! A model that does not predict the next force gives the one at the sample: both forces are then that one.
//! The force at any time between two samples is the linear interpolation of the two forces, so
//! [`Instance::wrench`] is pure and right at every stage of every integrator; only
//! [`Instance::advance`] evaluates the network, once a sample. A clock that was moved by hand (or a
//! state that was replaced without the plugin's) makes the instance start anew from where it is.

use std::{cell::RefCell, sync::Arc};

use hydro_frames::Wrench;
use hydro_model::{
    Encoder, Engine, Scratch,
    checkpoint::{Card, Checkpoint},
    envelope::{Excess, Limits},
};

use super::{
    attributes::{FRESH_WATER, InitialForce, Settings},
    body::{Body, BodyError},
    cold_start::{self, Place, Start},
    features::FeatureMap,
};

/// Names of the outputs a card may have, in the order of a wrench.
const COMPONENTS: [&str; 6] = [
    "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z",
];

const PHASE: usize = 0;
const SAMPLES: usize = 1;
const SAMPLE_TIME: usize = 2;
const STEP_TIME: usize = 3;
const OUT_OF_RANGE: usize = 4;
const FORCES: usize = 5;

/// The state's first number.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Cold = 0,
    Warm = 1,
    Faulted = 2,
}

impl Phase {
    fn of(state: &[f64]) -> Self {
        match state[PHASE] as u8 {
            0 => Self::Cold,
            1 => Self::Warm,
            _ => Self::Faulted,
        }
    }

    fn write(self, state: &mut [f64]) {
        state[PHASE] = f64::from(self as u8);
    }
}

/// How far a step may miss a sample and still count as on it, as a part of the sample period.
const ON_SAMPLE: f64 = 1e-6;

/// How far a clock may run off before it counts as moved, as a part of the step.
const SAME_CLOCK: f64 = 1e-3;

/// How many times the range of its training a model is asked in that is given closed forms of the water's force (the range
/// of forces grows by the square): what it learned to weigh goes on to hold. Open loop, on Task 2 at speeds beyond
/// (`gen_task2.py --regime speeds`), nRMSE of such a perceptron was 0.31 with this, 0.31 if asked anywhere, and 0.48 if held
/// to the range itself; without closed forms an LSTM's was 0.72 held to the range and 0.80 if asked anywhere.
const CLOSED_FORMS_REACH: f64 = 2.0;

/// Deviations from the mean within which a density counts as trained.
const TRAINED: f64 = 4.0;

/// Samples that one step may span; a longer jump starts anew.
const MOST_SAMPLES_A_STEP: usize = 1000;

/// When, and in what state of the model.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Simulation time [s].
    pub time: f64,
    /// Step of the simulation [s].
    pub timestep: f64,
    /// True under MuJoCo's Runge-Kutta integrator, which evaluates forces inside a step.
    pub runge_kutta: bool,
    /// Positions [nq].
    pub qpos: &'a [f64],
    /// Velocities [nv].
    pub qvel: &'a [f64],
    /// Velocity of the water at the base beside attribute `current`, world [m/s].
    pub water: [f64; 3],
}

impl Moment<'_> {
    fn is_finite(&self) -> bool {
        finite(self.qpos) && finite(self.qvel)
    }
}

/// What a user should hear of. That a fault or a start is told once, the memory in the state sees to:
/// each notice comes with a change of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// The step does not divide the sample period: features are interpolated.
    StepDoesNotDivide,
    /// A velocity is out of the network's range, for the first time since the start's own sample.
    OutOfRange(Excess),
    /// A state or a prediction that is no number: zero wrench until a reset.
    NotFinite,
    /// The engine's own fluid acts as well.
    FluidCountedTwice,
    /// The water is unlike any that the model was trained in.
    DensityOutsideTraining {
        /// The attribute [kg/m^3].
        found: f64,
        /// What the model was trained in, mean and four standard deviations to each side [kg/m^3].
        trained: (f64, f64),
    },
    /// The model was trained on a path that needs the future.
    ControlReplaced,
    /// The model has no density among its features.
    DensityUnused {
        /// The attribute [kg/m^3].
        found: f64,
    },
}

impl Notice {
    /// What a user reads, at `time` [s], with steps of `timestep` [s] and samples of `sample_period` [s].
    pub fn text(self, time: f64, timestep: f64, sample_period: f64) -> String {
        match self {
            Self::StepDoesNotDivide => format!(
                "the step of {timestep} s does not divide the checkpoint's sample period of {sample_period} s; \
                 samples are interpolated"
            ),
            Self::OutOfRange(Excess {
                velocity,
                found,
                range: (least, most),
            }) => {
                let unit = velocity.unit();
                format!(
                    "`{velocity}` is {found:.3} {unit} at t = {time} s; the checkpoint's network is asked between {least:.3} \
                     and {most:.3} {unit} alone, which its card's `envelope` sets: it is told the nearest, and a drag acts on \
                     what is left of a base velocity; take the force for a guess while it is out there"
                )
            }
            Self::NotFinite => format!(
                "the state or the predicted force is not a number at t = {time} s; the wrench is zero until the \
                 simulation is reset"
            ),
            Self::FluidCountedTwice => {
                "option density or viscosity is above 0, which switches MuJoCo's own fluid \
                 on for every body, so the water counts twice; set both to 0"
                    .to_owned()
            }
            Self::DensityOutsideTraining {
                found,
                trained: (least, most),
            } => format!(
                "attribute `density` is {found} kg/m^3; the checkpoint was trained from {least:.1} to {most:.1} \
                 kg/m^3, and what it predicts elsewhere is a guess"
            ),
            Self::ControlReplaced => {
                "the checkpoint's CNODE was trained on the natural spline of whole trajectories; a simulation has the \
                 past alone and takes the hermite path, so the errors in its card are not those here"
                    .to_owned()
            }
            Self::DensityUnused { found } => format!(
                "attribute `density` is {found} kg/m^3; the checkpoint has no feature `density`, so that \
                 changes nothing"
            ),
        }
    }
}

/// Settings, features and network, tied to one model.
#[derive(Debug)]
pub struct Instance {
    settings: Settings,
    features: FeatureMap,
    engine: Arc<dyn Engine>,
    /// What the network is held to.
    limits: Limits,
    /// Where each output goes in a wrench [f].
    components: Vec<usize>,
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

/// How many numbers of state an engine's instance needs.
pub fn state_len(engine: &dyn Engine) -> usize {
    FORCES + 3 * engine.outputs() + engine.inputs() + engine.memory_len()
}

impl Instance {
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
        let mut components = Vec::with_capacity(card.outputs.len());
        for output in &card.outputs {
            match COMPONENTS.iter().position(|known| known == output) {
                Some(at) if !components.contains(&at) => components.push(at),
                _ => {
                    return Err(BodyError::Output {
                        found: output.clone(),
                    });
                }
            }
        }
        if let InitialForce::Given(force) = &settings.initial_force
            && force.len() != components.len()
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
            engine,
            limits: limits(card),
            components,
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

    /// How many numbers the state slice holds.
    pub fn state_len(&self) -> usize {
        state_len(&*self.engine)
    }

    /// Forgets everything: the next force is that of a cold start.
    pub fn reset(state: &mut [f64]) {
        state.fill(0.0);
        cold_start::take(place(state));
    }

    /// True where a state slice holds no memory yet.
    pub fn is_cold(state: &[f64]) -> bool {
        Phase::of(state) == Phase::Cold
    }

    /// What a user should hear of when a model is loaded, where `native_fluid` is MuJoCo's own fluid.
    pub fn notices_at_load(&self, native_fluid: bool) -> impl Iterator<Item = Notice> {
        (native_fluid && !self.residual)
            .then_some(Notice::FluidCountedTwice)
            .into_iter()
            .chain(self.density_notice.clone())
            .chain(self.control_notice.clone())
    }

    /// The wrench at a moment, of a fully submerged robot; changes nothing. Zero where the moment is no
    /// number, though only a step's end makes that a fault.
    pub fn wrench(&self, state: &[f64], moment: Moment<'_>) -> Wrench {
        if state.len() != self.state_len()
            || Phase::of(state) == Phase::Faulted
            || !moment.is_finite()
        {
            return Wrench::default();
        }
        let outputs = self.components.len();
        if Phase::of(state) == Phase::Warm && within_step(state[STEP_TIME], moment) {
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
        if let Some(wrench) = cold_start::with(place, inner).flatten() {
            return wrench;
        }
        match self.first_sample(place, moment) {
            Some(start) => {
                let wrench = self.after(&start, moment.time);
                cold_start::remember(place, start);
                wrench
            }
            None => Wrench::default(),
        }
    }

    /// Takes the samples that the step to `moment` reached, and evaluates the network at each.
    pub fn advance(&self, state: &mut [f64], moment: Moment<'_>) -> Option<Notice> {
        if state.len() != self.state_len() || Phase::of(state) == Phase::Faulted {
            return None;
        }
        if !moment.is_finite() {
            return Some(self.fault(state));
        }
        let began = moment.time - moment.timestep;
        let slack = SAME_CLOCK * moment.timestep;
        if Phase::of(state) == Phase::Cold || (state[STEP_TIME] - began).abs() > slack {
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

    /// Where there is no hook at a step's end: takes the state at hand as that of the step's end.
    ///
    /// The first call after a reset is a cold start; a second one at the same time starts again, for a
    /// simulation is often moved before its first step.
    pub fn follow_clock(&self, state: &mut [f64], moment: Moment<'_>) -> Option<Notice> {
        if state.len() != self.state_len() || Phase::of(state) == Phase::Faulted {
            return None;
        }
        if !moment.is_finite() {
            return Some(self.fault(state));
        }
        let slack = SAME_CLOCK * moment.timestep;
        let elapsed = moment.time - state[STEP_TIME];
        let untouched = state[SAMPLES] == 1.0 && state[STEP_TIME] == state[SAMPLE_TIME];
        if Phase::of(state) == Phase::Warm && elapsed == 0.0 && !untouched {
            return None;
        }
        if Phase::of(state) == Phase::Warm && elapsed > 0.0 && elapsed <= moment.timestep + slack {
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
        let (inputs, outputs) = (self.features.len(), self.components.len());
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
        let mut drag = vec![0.0; outputs];
        self.limits.drag(&sample, &mut drag);
        let mut held = sample.clone();
        self.limits.hold(&mut held);
        WORKSPACE.with_borrow_mut(|work| {
            let (mut carried, mut now, mut next) =
                (vec![0.0; outputs], vec![0.0; outputs], vec![0.0; outputs]);
            match &self.settings.initial_force {
                InitialForce::Given(force) => carried.copy_from_slice(force),
                InitialForce::Estimate => {
                    self.engine.estimate(&held, &mut carried, &mut work.scratch)
                }
            }
            self.limits.hold_force(&mut carried);
            let mut memory = vec![0.0; self.engine.memory_len()];
            self.engine
                .start(&held, &carried, &mut memory, &mut work.scratch);
            self.engine
                .sample(&memory, &carried, &mut now, &mut next, &mut work.scratch);
            let sound = finite(&now) && finite(&next) && finite(&drag);
            self.limits.hold_force(&mut now);
            self.limits.hold_force(&mut next);
            sound.then_some(Start {
                time: moment.time,
                sample,
                now,
                next,
                drag,
            })
        })
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
        let mut held = start.sample.clone();
        self.limits.hold(&mut held);
        WORKSPACE.with_borrow_mut(|work| {
            self.engine
                .start(&held, &start.now, rest, &mut work.scratch);
        });
    }

    /// From the latest step's end to `moment`: takes the samples in between.
    fn follow(&self, state: &mut [f64], moment: Moment<'_>) -> Option<Notice> {
        let (inputs, outputs) = (self.features.len(), self.components.len());
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
                    && let Some(excess) = self.limits.excess(between)
                {
                    head[OUT_OF_RANGE] = 1.0;
                    notice = Some(Notice::OutOfRange(excess));
                }
                self.limits.drag(between, drag);
                self.limits.hold(between);
                self.engine.observe(between, memory, scratch);
                let (now, next) = forces.split_at_mut(outputs);
                carried.copy_from_slice(next);
                self.engine.sample(memory, carried, now, next, scratch);
                // Before they are held: an infinite force is no great one.
                if !finite(now) || !finite(next) || !finite(drag) {
                    return Some(self.fault(state));
                }
                self.limits.hold_force(now);
                self.limits.hold_force(next);
            }
            state[STEP_TIME] = moment.time;
            let previous = FORCES + 3 * outputs;
            state[previous..previous + inputs].copy_from_slice(sample);
            notice
        })
    }

    /// The wrench at `time`, after a cold start.
    fn after(&self, start: &Start, time: f64) -> Wrench {
        self.between(start.time, &start.now, &start.next, &start.drag, time)
    }

    /// The wrench at `time`, between the forces at two samples [f], with the drag [f] at the first. Here alone `wrench_scale`
    /// counts: what the network carries from sample to sample is its own.
    fn between(
        &self,
        sample_time: f64,
        now: &[f64],
        next: &[f64],
        drag: &[f64],
        time: f64,
    ) -> Wrench {
        let fraction = ((time - sample_time) / self.sample_period).clamp(0.0, 1.0);
        let mut wrench = [0.0; 6];
        for (output, component) in self.components.iter().enumerate() {
            let learned = now[output] + fraction * (next[output] - now[output]);
            wrench[*component] = self.settings.wrench_scale[*component] * (learned + drag[output]);
        }
        Wrench::from_array(wrench)
    }
}

/// What the network of a card is held to: nothing, where the card does not say what it was trained on.
fn limits(card: &Card) -> Limits {
    let Some(envelope) = card.envelope.clone() else {
        return Limits::default();
    };
    let reach = match card.model.encoding().has_closed_forms() {
        true => envelope.widened(CLOSED_FORMS_REACH),
        false => envelope,
    };
    Limits::new(reach, &card.features, &card.outputs)
}

/// What to say of a density attribute [kg/m^3] that the card's model cannot be expected to know.
fn density_notice(card: &Card, found: f64) -> Option<Notice> {
    let Some(at) = card.features.density() else {
        let other = (found - FRESH_WATER).abs() > 0.0;
        return other.then_some(Notice::DensityUnused { found });
    };
    let at = Encoder::new(card.model.encoding(), &card.features).index_of(at)?;
    let (mean, std) = (
        card.normaliser.input_mean[at],
        card.normaliser.input_std[at],
    );
    let trained = (mean - TRAINED * std, mean + TRAINED * std);
    let outside = !(trained.0..=trained.1).contains(&found);
    outside.then_some(Notice::DensityOutsideTraining { found, trained })
}

fn place(state: &[f64]) -> Place {
    state.as_ptr() as Place
}

fn finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}

/// True where `moment` lies in the step that began at `began`, or at its ends.
fn within_step(began: f64, moment: Moment<'_>) -> bool {
    let slack = SAME_CLOCK * moment.timestep;
    (began - slack..=began + moment.timestep + slack).contains(&moment.time)
}

#[cfg(test)]
mod tests;
