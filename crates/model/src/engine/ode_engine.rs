//! Engine of the Attention-ODE and the MLP-ODE: a field stepped by the products of this crate, without allocation, threads
//! or Candle.

use pulp::Arch;

use super::{
    batched::Lockstep,
    field_stepper::{FieldStepper, Stepped},
    interface::{Engine, SETTLED, SETTLING_STEPS, Scratch, one_by_one, samples},
    packed_perceptron::Precision,
};
use crate::{error::ModelError, force_model::ForceModel, solver::dormand_prince::Clock};

/// The engine; see the module.
#[derive(Clone, Debug)]
pub(super) struct OdeEngine {
    stepper: FieldStepper,
}

impl OdeEngine {
    pub(super) fn new(
        model: &ForceModel,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        Ok(Self {
            stepper: FieldStepper::new(model, precision, arch)?,
        })
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
        let FieldStepper {
            arch,
            units,
            field: perceptron,
            ode,
            ..
        } = &self.stepper;
        let field = &perceptron.config;
        let scratch = scratch.take(self.stepper.scratch());
        let (input, rest) = scratch.split_at_mut(field.inputs);
        let (now, rest) = rest.split_at_mut(field.outputs);
        let (slope, rest) = rest.split_at_mut(ode.slopes() * field.outputs);
        let (change, rest) = rest.split_at_mut(field.outputs);
        let (layers, rest) = rest.split_at_mut(perceptron.scratch());
        let latent = field.inputs - ode.latent.len();
        ode.latent
            .evaluate(*arch, self.stepper.ring(memory), &mut input[latent..], rest);
        match start {
            Some(start) => units.standardise(start, now),
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
                perceptron.evaluate(*arch, x, y, layers);
            });
            if change.iter().all(|change| change.abs() < SETTLED) {
                break;
            }
        }
        units.to_si(now.iter().copied(), force);
    }
}

impl Engine for OdeEngine {
    fn inputs(&self) -> usize {
        self.stepper.units.features()
    }

    fn outputs(&self) -> usize {
        self.stepper.field.config.outputs
    }

    fn memory_len(&self) -> usize {
        self.stepper.memory_len()
    }

    fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], _: &mut Scratch) {
        self.stepper.start(x, memory);
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], _: &mut Scratch) {
        self.stepper.observe(x, memory);
    }

    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    ) {
        if self.stepper.is_first(memory) {
            next.copy_from_slice(force);
        } else {
            self.advance(memory, Some(force), next, 1, scratch);
        }
        now.copy_from_slice(if self.stepper.end_of_step {
            next
        } else {
            force
        });
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
        Ok(Lockstep::new(&self.stepper, samples).run_all(x, start, scratch))
    }
}
