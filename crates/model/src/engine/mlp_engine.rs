//! Engine of the memoryless MLP. Memory: the newest sample, encoded [n].

use pulp::Arch;

use super::{
    interface::{BLOCK, Engine, Scratch, samples},
    packed_perceptron::{Buffers, PackedPerceptron, Precision},
    units::Units,
};
use crate::{architectures::Mlp, error::ModelError, force_model::ForceModel};

/// The engine; see the module.
#[derive(Clone, Debug)]
pub(super) struct MlpEngine {
    arch: Arch,
    units: Units,
    field: PackedPerceptron,
}

impl MlpEngine {
    pub(super) fn new(
        model: &ForceModel,
        mlp: &Mlp,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        Ok(Self {
            arch,
            units: Units::from_model(model),
            field: PackedPerceptron::new(&mlp.field, precision)?,
        })
    }
}

impl Engine for MlpEngine {
    fn inputs(&self) -> usize {
        self.units.features()
    }

    fn outputs(&self) -> usize {
        self.field.config.outputs
    }

    fn memory_len(&self) -> usize {
        self.units.encoded()
    }

    fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        self.observe(x, memory, scratch);
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], _: &mut Scratch) {
        self.units.encode(x, memory);
    }

    fn sample(
        &self,
        memory: &[f64],
        _: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let (inputs, outputs) = (memory.len(), now.len());
        let scratch = scratch.take(inputs + outputs + self.field.scratch());
        let (input, rest) = scratch.split_at_mut(inputs);
        let (found, layers) = rest.split_at_mut(outputs);
        for (slot, z) in input.iter_mut().zip(memory) {
            *slot = *z as f32;
        }
        self.field.evaluate(self.arch, input, found, layers);
        self.units.to_si(found.iter().copied(), now);
        next.copy_from_slice(now);
    }

    /// Many samples are one product; bit for bit the numbers of the single step.
    fn trajectories(
        &self,
        x: &[f64],
        start: &[f64],
        _: &mut Scratch,
    ) -> Result<Vec<f64>, ModelError> {
        let samples = samples(self, x, start)?;
        let (inputs, outputs, width) = (self.inputs(), self.outputs(), self.units.encoded());
        let (field, mut buffers) = (self.field.batched(), Buffers::default());
        let mut forces = vec![0.0; samples * start.len()];
        let (mut z, mut found) = (Vec::new(), Vec::new());
        for (x, forces) in x
            .chunks(BLOCK * inputs)
            .zip(forces.chunks_mut(BLOCK * outputs))
        {
            z.resize(x.len() / inputs * width, 0.0);
            found.resize(forces.len(), 0.0);
            self.units.encode(x, &mut z);
            field.evaluate(self.arch, &z, &mut found, &mut buffers);
            self.units.to_si(found.iter().copied(), forces);
        }
        Ok(forces)
    }
}
