//! A force of the newest sample alone, by our own products. Memory: that sample, encoded [n].

use pulp::Arch;

use super::{
    super::{ForceModel, ModelError, encoding::Encoder, mlp::Mlp, normaliser::Normaliser},
    Engine, Scratch,
    perceptron::{Buffers, Perceptron, Precision},
    samples,
};

/// Samples whose forces are one product.
const BLOCK: usize = 256;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct MemorylessEngine {
    arch: Arch,
    encoder: Encoder,
    normaliser: Normaliser,
    field: Perceptron,
}

impl MemorylessEngine {
    pub(super) fn new(
        model: &ForceModel,
        mlp: &Mlp,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        Ok(Self {
            arch,
            encoder: model.encoder.clone(),
            normaliser: model.normaliser.clone(),
            field: Perceptron::new(&mlp.field, precision)?,
        })
    }

    fn to_si(&self, found: &[f32], force: &mut [f64]) {
        for (i, (force, found)) in force.iter_mut().zip(found).enumerate() {
            *force = self.normaliser.to_si(i, *found);
        }
    }
}

impl Engine for MemorylessEngine {
    fn inputs(&self) -> usize {
        self.encoder.inputs()
    }

    fn outputs(&self) -> usize {
        self.field.config.outputs
    }

    fn memory_len(&self) -> usize {
        self.encoder.len()
    }

    fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        self.observe(x, memory, scratch);
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], _: &mut Scratch) {
        self.encoder.encode(x, |i, value| {
            memory[i] = f64::from(self.normaliser.input(i, value));
        });
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
        self.to_si(found, now);
        next.copy_from_slice(now);
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut memory = vec![0.0; self.memory_len()];
        self.observe(x, &mut memory, scratch);
        let mut held = vec![0.0; force.len()];
        self.sample(&memory, &[], force, &mut held, scratch);
    }

    /// Many samples are one product; bit for bit the numbers of the single step.
    fn trajectories(
        &self,
        x: &[f64],
        start: &[f64],
        _: &mut Scratch,
    ) -> Result<Vec<f64>, ModelError> {
        let samples = samples(self, x, start)?;
        let (inputs, outputs, width) = (self.inputs(), self.outputs(), self.encoder.len());
        let (field, mut buffers) = (self.field.batched(), Buffers::default());
        let mut forces = vec![0.0; samples * start.len()];
        let (mut z, mut found) = (Vec::new(), Vec::new());
        for (x, forces) in x
            .chunks(BLOCK * inputs)
            .zip(forces.chunks_mut(BLOCK * outputs))
        {
            z.resize(x.len() / inputs * width, 0.0);
            found.resize(forces.len(), 0.0);
            for (x, z) in x.chunks_exact(inputs).zip(z.chunks_exact_mut(width)) {
                self.encoder
                    .encode(x, |i, value| z[i] = self.normaliser.input(i, value));
            }
            field.evaluate(self.arch, &z, &mut found, &mut buffers);
            for (found, force) in found
                .chunks_exact(outputs)
                .zip(forces.chunks_exact_mut(outputs))
            {
                self.to_si(found, force);
            }
        }
        Ok(forces)
    }
}
