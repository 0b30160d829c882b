//! A field stepped by our own products: no allocation, no threads, no Candle.

use pulp::Arch;

use super::{
    super::{
        ForceModel, ModelError, Network,
        adaptive::{Clock, Period, STAGES},
        solver::Solver,
    },
    Engine, SETTLED, SETTLING_STEPS, Scratch,
    latent::Latent,
    one_by_one,
    past::{self, Past},
    perceptron::{Perceptron, Precision},
    samples,
    together::Together,
    units::Units,
};

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct FusedEngine {
    /// The instructions of this machine, or those that a test asks for.
    pub(super) arch: Arch,
    pub(super) units: Units,
    pub(super) field: Perceptron,
    pub(super) ode: Ode,
}

/// What makes a force of the field's slopes.
#[derive(Clone, Debug)]
pub(super) struct Ode {
    solver: Solver,
    pub(super) latent: Latent,
    field_sees_force: bool,
}

impl Ode {
    /// Stages whose slopes a step holds at a time.
    pub(super) fn slopes(&self) -> usize {
        let stages = self.solver.stages(self.field_sees_force);
        stages.map_or(STAGES, |_| 1)
    }

    /// The forces move on by one sample period; each row of `input` [rows, inputs] holds h behind the force's place, and
    /// `evaluate` is the field of some rows. By adaptive steps h of more than one row is spent.
    pub(super) fn step(
        &self,
        Stepped {
            force,
            slope,
            change,
            clocks,
        }: Stepped<'_>,
        outputs: usize,
        input: &mut [f32],
        mut evaluate: impl FnMut(&[f32], &mut [f32]),
    ) {
        let Some(tableau) = self.solver.stages(self.field_sees_force) else {
            change.copy_from_slice(force);
            let period = Period {
                force: &mut *force,
                input,
                slopes: slope,
                clocks,
            };
            period.run(evaluate, |_, _, _| ());
            for (change, force) in change.iter_mut().zip(force.iter()) {
                *change = force - *change;
            }
            return;
        };
        let width = input.len() / (force.len() / outputs);
        slope.fill(0.0);
        change.fill(0.0);
        for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
            if self.field_sees_force {
                for ((row, force), slope) in input
                    .chunks_exact_mut(width)
                    .zip(force.chunks_exact(outputs))
                    .zip(slope.chunks_exact(outputs))
                {
                    for ((slot, force), slope) in row.iter_mut().zip(force).zip(slope) {
                        *slot = force + *along as f32 * slope;
                    }
                }
            }
            evaluate(input, slope);
            for (change, slope) in change.iter_mut().zip(slope.iter()) {
                *change += *weight as f32 * slope;
            }
        }
        for (force, change) in force.iter_mut().zip(change.iter()) {
            *force += *change;
        }
    }
}

/// The forces of some rows [rows, f] and a step's buffers of them.
pub(super) struct Stepped<'a> {
    pub(super) force: &'a mut [f32],
    /// Of [`Ode::slopes`] stages.
    pub(super) slope: &'a mut [f32],
    pub(super) change: &'a mut [f32],
    /// [rows].
    pub(super) clocks: &'a mut [Clock],
}

impl FusedEngine {
    pub(super) fn new(
        model: &ForceModel,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        let (ode, latent) = match &model.network {
            Network::AttentionOde(network) => {
                (&network.ode, Latent::Attention(Past::new(network)?))
            }
            // Small beside the field, and what it makes drives the field: always in f32.
            Network::MlpOde(network) => {
                let latent = Perceptron::new(&network.latent, Precision::Single)?;
                (&network.ode, Latent::Perceptron(latent))
            }
            other => candle_core::bail!("{other:?} is not stepped by a field"),
        };
        Ok(Self {
            arch,
            units: Units::of(model),
            field: Perceptron::new(&ode.field, precision)?,
            ode: Ode {
                solver: model.solver,
                field_sees_force: ode.field_sees_force,
                latent,
            },
        })
    }

    /// Numbers of scratch in all: field input, force, slopes, layers, and what the latent takes.
    fn scratch(&self) -> usize {
        let field = &self.field.config;
        let forces = 2 + self.ode.slopes();
        field.inputs + forces * field.outputs + self.field.scratch() + self.ode.latent.scratch()
    }

    /// `force` [f] after `steps` at most from `start` [f], or from the training mean.
    fn advance(
        &self,
        memory: &[f64],
        start: Option<&[f64]>,
        force: &mut [f64],
        steps: usize,
        scratch: &mut Scratch,
    ) {
        let (ode, field) = (&self.ode, &self.field.config);
        let scratch = scratch.take(self.scratch());
        let (input, rest) = scratch.split_at_mut(field.inputs);
        let (now, rest) = rest.split_at_mut(field.outputs);
        let (slope, rest) = rest.split_at_mut(ode.slopes() * field.outputs);
        let (change, rest) = rest.split_at_mut(field.outputs);
        let (layers, rest) = rest.split_at_mut(self.field.scratch());
        let latent = field.inputs - ode.latent.len();
        ode.latent
            .evaluate(self.arch, memory, &mut input[latent..], rest);
        match start {
            Some(start) => self.units.standardise(start, now),
            None => now.fill(0.0),
        }
        let mut clocks = [Clock::default()];
        for _ in 0..steps {
            let stepped = Stepped {
                force: &mut *now,
                slope: &mut *slope,
                change: &mut *change,
                clocks: &mut clocks,
            };
            ode.step(stepped, field.outputs, input, |x, y| {
                self.field.evaluate(self.arch, x, y, layers);
            });
            if change.iter().all(|change| change.abs() < SETTLED) {
                break;
            }
        }
        self.units.to_si(now.iter().copied(), force);
    }
}

impl Engine for FusedEngine {
    fn inputs(&self) -> usize {
        self.units.features()
    }

    fn outputs(&self) -> usize {
        self.field.config.outputs
    }

    fn memory_len(&self) -> usize {
        past::memory_len(self.ode.latent.window(), self.units.encoded())
    }

    fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], _: &mut Scratch) {
        past::fill(memory, self.units.encoded(), |z| self.units.encode(x, z));
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], _: &mut Scratch) {
        past::push(memory, self.units.encoded(), |z| self.units.encode(x, z));
    }

    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    ) {
        now.copy_from_slice(force);
        self.advance(memory, Some(force), next, 1, scratch);
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut memory = vec![0.0; self.memory_len()];
        self.start(x, &[], &mut memory, scratch);
        self.advance(&memory, None, force, SETTLING_STEPS, scratch);
    }

    fn trajectories(
        &self,
        x: &[f64],
        start: &[f64],
        scratch: &mut Scratch,
    ) -> Result<Vec<f64>, ModelError> {
        // The products of many rows are slower for a single one.
        if start.len() == self.outputs() {
            return one_by_one(self, x, start, scratch);
        }
        let samples = samples(self, x, start)?;
        Ok(Together::new(self, samples).run_all(x, start, scratch))
    }
}
