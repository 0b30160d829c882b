//! A Relaxation-ODE: targets and rates by our own products, then the exact step.
//!
//! Memory: a ring as [`super::past`] has it; its first number is [`FRESH`] until a second sample came, for F_0 is the
//! force at the first.

use pulp::Arch;

use super::{
    super::{ForceModel, ModelError, kernel::sigmoid, relaxation_ode::RelaxationOde},
    BLOCK, Engine, Scratch, past,
    perceptron::{Buffers, Perceptron, Precision},
    samples,
    units::Units,
};

/// In the place of the newest slot, and like nothing there below zero: the memory holds the first sample alone.
const FRESH: f64 = -1.0;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct RelaxingEngine {
    arch: Arch,
    units: Units,
    window: usize,
    /// h [W n] -> [F_inf; kappa] [2 f].
    field: Perceptron,
}

impl RelaxingEngine {
    pub(super) fn new(
        model: &ForceModel,
        ode: &RelaxationOde,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        Ok(Self {
            arch,
            units: Units::of(model),
            window: ode.window,
            field: Perceptron::new(&ode.field, precision)?,
        })
    }

    /// h [W n], of the samples that `lagged` gives: element `i` of the sample so many steps back.
    fn latent(&self, h: &mut [f32], lagged: impl Fn(usize, usize) -> f32) {
        for (lag, part) in h.chunks_exact_mut(self.units.encoded()).enumerate() {
            for (i, slot) in part.iter_mut().enumerate() {
                *slot = if lag == 0 {
                    lagged(0, i)
                } else {
                    lagged(lag - 1, i) - lagged(lag, i)
                };
            }
        }
    }

    /// [F_inf; share of the way] [2 f] of a memory.
    fn evaluate<'a>(&self, memory: &[f64], scratch: &'a mut Scratch) -> &'a [f32] {
        let (width, inputs) = (self.units.encoded(), self.field.config.inputs);
        let found = self.field.config.outputs;
        let scratch = scratch.take(inputs + found + self.field.scratch());
        let (h, rest) = scratch.split_at_mut(inputs);
        let (found, layers) = rest.split_at_mut(found);
        let newest = past::newest(memory, self.window);
        self.latent(h, |lag, i| {
            let slot = (newest + self.window - lag) % self.window;
            memory[1 + slot * width + i] as f32
        });
        self.field.evaluate(self.arch, h, found, layers);
        let outputs = found.len() / 2;
        sigmoid(self.arch, &mut found[outputs..]);
        found
    }

    /// `force` [f] after a step.
    fn relax(&self, force: &mut [f64], found: &[f32]) {
        let (target, share) = found.split_at(force.len());
        let normaliser = &self.units.normaliser;
        for (i, (force, (target, share))) in
            force.iter_mut().zip(target.iter().zip(share)).enumerate()
        {
            let before = normaliser.force(i, *force);
            *force = normaliser.to_si(i, before + share * (target - before));
        }
    }
}

impl Engine for RelaxingEngine {
    fn inputs(&self) -> usize {
        self.units.features()
    }

    fn outputs(&self) -> usize {
        self.field.config.outputs / 2
    }

    fn memory_len(&self) -> usize {
        past::memory_len(self.window, self.units.encoded())
    }

    fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], _: &mut Scratch) {
        past::fill(memory, self.units.encoded(), |z| self.units.encode(x, z));
        memory[0] = FRESH;
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
        let fresh = memory[0] < 0.0;
        if !fresh {
            self.relax(now, self.evaluate(memory, scratch));
        }
        next.copy_from_slice(now);
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut memory = vec![0.0; self.memory_len()];
        self.start(x, &[], &mut memory, scratch);
        let found = self.evaluate(&memory, scratch);
        self.units.to_si(found.iter().copied(), force);
    }

    /// Targets and rates of many samples are one product; bit for bit those of the single step.
    fn trajectories(
        &self,
        x: &[f64],
        start: &[f64],
        _: &mut Scratch,
    ) -> Result<Vec<f64>, ModelError> {
        let samples = samples(self, x, start)?;
        let (inputs, outputs, width) = (self.inputs(), self.outputs(), self.units.encoded());
        let (field, mut buffers) = (self.field.batched(), Buffers::default());
        let mut forces = Vec::with_capacity(samples * start.len());
        let mut z = vec![0.0f32; samples * width];
        let (mut h, mut found) = (Vec::new(), Vec::new());
        for (x, start) in x
            .chunks_exact((samples * inputs).max(1))
            .zip(start.chunks_exact(outputs))
        {
            self.units.encode(x, &mut z);
            let mut force = start.to_vec();
            forces.extend_from_slice(&force);
            for first in (1..samples).step_by(BLOCK) {
                let rows = BLOCK.min(samples - first);
                h.resize(rows * self.field.config.inputs, 0.0);
                found.resize(rows * 2 * outputs, 0.0);
                for (row, h) in h.chunks_exact_mut(self.field.config.inputs).enumerate() {
                    self.latent(h, |lag, i| z[(first + row).saturating_sub(lag) * width + i]);
                }
                field.evaluate(self.arch, &h, &mut found, &mut buffers);
                for found in found.chunks_exact_mut(2 * outputs) {
                    sigmoid(self.arch, &mut found[outputs..]);
                    self.relax(&mut force, found);
                    forces.extend_from_slice(&force);
                }
            }
        }
        Ok(forces)
    }
}
