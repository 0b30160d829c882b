//! Several trajectories stepped together, so that the field's weights are read once for all of them.
//!
//! Each row has the numbers of the single step, bit for bit, since the products give the same for one row and for many.

use super::{
    field_stepper::{FieldStepper, Stepped},
    interface::{BATCH_SIZE, Scratch},
    packed_perceptron::{Batched, Buffers},
};
use crate::solver::dormand_prince::Clock;

/// Some trajectories of one length.
pub(super) struct Lockstep<'a> {
    stepper: &'a FieldStepper,
    field: Batched<'a>,
    samples: usize,
    buffers: Buffers,
    /// Memory of each row.
    memory: Vec<f64>,
    /// Field input, force, slopes and change of each row.
    input: Vec<f32>,
    now: Vec<f32>,
    slope: Vec<f32>,
    change: Vec<f32>,
    clocks: Vec<Clock>,
}

impl<'a> Lockstep<'a> {
    pub(super) fn new(stepper: &'a FieldStepper, samples: usize) -> Self {
        Self {
            stepper,
            field: stepper.field.batched(),
            samples,
            buffers: Buffers::default(),
            memory: Vec::new(),
            input: Vec::new(),
            now: Vec::new(),
            slope: Vec::new(),
            change: Vec::new(),
            clocks: Vec::new(),
        }
    }

    /// x [B, T, n], F_0 [B, f] -> F [B, T, f], [`BATCH_SIZE`] at a time.
    pub(super) fn run_all(mut self, x: &[f64], start: &[f64], scratch: &mut Scratch) -> Vec<f64> {
        let (inputs, outputs) = (
            self.stepper.units.features(),
            self.stepper.field.config.outputs,
        );
        let mut forces = vec![0.0; self.samples * start.len()];
        for ((x, start), forces) in x
            .chunks((BATCH_SIZE * self.samples * inputs).max(1))
            .zip(start.chunks(BATCH_SIZE * outputs))
            .zip(forces.chunks_mut((BATCH_SIZE * self.samples * outputs).max(1)))
        {
            self.run(x, start, forces, scratch);
        }
        forces
    }

    fn run(&mut self, x: &[f64], start: &[f64], forces: &mut [f64], scratch: &mut Scratch) {
        let (stepper, samples) = (self.stepper, self.samples);
        let (inputs, outputs) = (stepper.units.features(), stepper.field.config.outputs);
        let rows = start.len() / outputs;
        let memory = stepper.memory_len();
        self.memory.resize(rows * memory, 0.0);
        self.input.resize(rows * stepper.field.config.inputs, 0.0);
        for numbers in [&mut self.now, &mut self.change] {
            numbers.resize(rows * outputs, 0.0);
        }
        self.slope
            .resize(stepper.ode.slopes() * rows * outputs, 0.0);
        self.clocks.resize(rows, Clock::default());
        let put = |forces: &mut [f64], sample: usize, values: &[f64]| {
            for (row, values) in values.chunks_exact(outputs).enumerate() {
                forces[(row * samples + sample) * outputs..][..outputs].copy_from_slice(values);
            }
        };
        let mut carried = start.to_vec();
        for sample in 0..samples {
            for (row, memory) in self.memory.chunks_exact_mut(memory).enumerate() {
                let x = &x[(row * samples + sample) * inputs..][..inputs];
                if sample == 0 {
                    stepper.start(x, memory);
                } else {
                    stepper.observe(x, memory);
                }
            }
            if stepper.end_of_step && sample > 0 {
                self.step(&mut carried, scratch);
            }
            put(forces, sample, &carried);
            if !stepper.end_of_step {
                self.step(&mut carried, scratch);
            }
        }
    }

    /// `carried` [rows, f] becomes the force at the next sample.
    fn step(&mut self, carried: &mut [f64], scratch: &mut Scratch) {
        let Self {
            stepper,
            field,
            buffers,
            memory,
            input,
            now,
            slope,
            change,
            clocks,
            ..
        } = self;
        let outputs = stepper.field.config.outputs;
        let width = stepper.field.config.inputs;
        let ode = &stepper.ode;
        let scratch = scratch.take(ode.latent.scratch());
        let sees = width - ode.latent.len();
        for (input, memory) in input
            .chunks_exact_mut(width)
            .zip(memory.chunks_exact(stepper.memory_len()))
        {
            ode.latent.evaluate(
                stepper.arch,
                stepper.ring(memory),
                &mut input[sees..],
                scratch,
            );
        }
        stepper.units.standardise(carried, now);
        let stepped = Stepped {
            force: now,
            slope,
            change,
            clocks,
        };
        ode.step(stepped, outputs, input, |x, y| {
            field.evaluate(stepper.arch, x, y, buffers);
        });
        stepper.units.to_si(now.iter().copied(), carried);
    }
}
