//! A model stepped by our own products: no allocation, no threads, no Candle.

use candle_core::Result;
use pulp::Arch;

use super::{
    super::{
        ForceModel, Network,
        encoding::Encoder,
        normaliser::Normaliser,
        solver::{Solver, Tableau},
    },
    Engine, SETTLED, SETTLING_STEPS, Scratch,
    past::{self, Past},
    perceptron::{Buffers, Perceptron, Precision},
    samples,
};

/// Trajectories that are stepped together: the weights are read once for all of them.
const TOGETHER: usize = 16;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct FusedEngine {
    /// The instructions of this machine, or those that a test asks for.
    pub(super) arch: Arch,
    encoder: Encoder,
    normaliser: Normaliser,
    field: Perceptron,
    /// None for a memoryless model.
    ode: Option<Ode>,
}

#[derive(Clone, Debug)]
struct Ode {
    solver: Solver,
    past: Past,
    field_sees_force: bool,
}

impl Ode {
    /// The stages of a step. A field that is not given the force has the same slope at each, so one is enough.
    fn tableau(&self) -> Tableau {
        if self.field_sees_force {
            self.solver.tableau()
        } else {
            Solver::Euler.tableau()
        }
    }
}

/// One step's buffers of a force [f].
struct Slopes<'a> {
    slope: &'a mut [f32],
    change: &'a mut [f32],
}

impl FusedEngine {
    pub(crate) fn new(model: &ForceModel, precision: Precision) -> Result<Self> {
        let (field, ode) = match &model.network {
            Network::AttentionOde(network) => {
                let ode = Ode {
                    solver: model.solver,
                    past: Past::new(network)?,
                    field_sees_force: network.config().field_sees_force,
                };
                (&network.field, Some(ode))
            }
            Network::Mlp(network) => (&network.field, None),
        };
        Ok(Self {
            arch: Arch::new(),
            encoder: model.encoder.clone(),
            normaliser: model.normaliser.clone(),
            field: Perceptron::new(field, precision)?,
            ode,
        })
    }

    /// W.
    fn window(&self) -> usize {
        self.ode.as_ref().map_or(1, |ode| ode.past.window())
    }

    /// Numbers of scratch in all: field input, force, slopes, layers, and what the latent takes.
    fn scratch(&self) -> usize {
        let latent = self.ode.as_ref().map_or(0, |ode| ode.past.scratch());
        let field = &self.field.config;
        field.inputs + 3 * field.outputs + self.field.scratch() + latent
    }

    /// z of a raw sample.
    fn encode(&self, x: &[f64], z: &mut [f64]) {
        self.encoder.encode(x, |i, value| {
            z[i] = f64::from(self.normaliser.input(i, value));
        });
    }

    /// `force` moves on by one step; `input` holds h behind the force's place.
    fn step(
        &self,
        ode: &Ode,
        force: &mut [f32],
        input: &mut [f32],
        Slopes { slope, change }: Slopes<'_>,
        layers: &mut [f32],
    ) {
        let tableau = ode.tableau();
        slope.fill(0.0);
        change.fill(0.0);
        for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
            if ode.field_sees_force {
                for ((slot, force), slope) in input.iter_mut().zip(force.iter()).zip(slope.iter()) {
                    *slot = force + *along as f32 * slope;
                }
            }
            self.field.evaluate(self.arch, input, slope, layers);
            for (change, slope) in change.iter_mut().zip(slope.iter()) {
                *change += *weight as f32 * slope;
            }
        }
        for (force, change) in force.iter_mut().zip(change.iter()) {
            *force += *change;
        }
    }

    /// Force after `steps` at most from `force` (in place), or g(x).
    fn advance(
        &self,
        memory: &[f64],
        force: &mut [f64],
        steps: usize,
        scratch: &mut Scratch,
        start: impl Fn(usize, f64) -> f32,
    ) {
        let field = &self.field.config;
        let scratch = scratch.take(self.scratch());
        let (input, rest) = scratch.split_at_mut(field.inputs);
        let (now, rest) = rest.split_at_mut(field.outputs);
        let (slope, rest) = rest.split_at_mut(field.outputs);
        let (change, rest) = rest.split_at_mut(field.outputs);
        let (layers, rest) = rest.split_at_mut(self.field.scratch());
        match &self.ode {
            None => {
                let z = &memory[1..];
                for (slot, z) in input.iter_mut().zip(z) {
                    *slot = *z as f32;
                }
                self.field.evaluate(self.arch, input, now, layers);
            }
            Some(ode) => {
                let latent = field.inputs - ode.past.latent_len();
                ode.past
                    .latent(self.arch, memory, &mut input[latent..], rest);
                for (i, (slot, value)) in now.iter_mut().zip(force.iter()).enumerate() {
                    *slot = start(i, *value);
                }
                for _ in 0..steps {
                    let slopes = Slopes {
                        slope: &mut *slope,
                        change: &mut *change,
                    };
                    self.step(ode, now, input, slopes, layers);
                    if change.iter().all(|change| change.abs() < SETTLED) {
                        break;
                    }
                }
            }
        }
        for (i, (slot, value)) in force.iter_mut().zip(now.iter()).enumerate() {
            *slot = self.normaliser.to_si(i, *value);
        }
    }
}

impl Engine for FusedEngine {
    fn inputs(&self) -> usize {
        self.encoder.inputs()
    }

    fn outputs(&self) -> usize {
        self.field.config.outputs
    }

    fn memory_len(&self) -> usize {
        past::memory_len(self.window(), self.encoder.len())
    }

    fn start(&self, x: &[f64], memory: &mut [f64]) {
        past::fill(memory, self.encoder.len(), |z| self.encode(x, z));
    }

    fn observe(&self, x: &[f64], memory: &mut [f64]) {
        past::push(memory, self.encoder.len(), |z| self.encode(x, z));
    }

    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    ) {
        next.copy_from_slice(force);
        self.advance(memory, next, 1, scratch, |i, value| {
            self.normaliser.force(i, value)
        });
        now.copy_from_slice(if self.ode.is_some() { force } else { next });
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut memory = vec![0.0; self.memory_len()];
        self.start(x, &mut memory);
        self.advance(&memory, force, SETTLING_STEPS, scratch, |_, _| 0.0);
    }

    fn trajectories(&self, x: &[f64], start: &[f64], scratch: &mut Scratch) -> Vec<f64> {
        let (inputs, outputs) = (self.inputs(), self.outputs());
        let samples = samples(self, x, start);
        let mut forces = vec![0.0; samples * start.len()];
        let mut together = Together::new(self, samples);
        for ((x, start), forces) in x
            .chunks((TOGETHER * samples * inputs).max(1))
            .zip(start.chunks(TOGETHER * outputs))
            .zip(forces.chunks_mut((TOGETHER * samples * outputs).max(1)))
        {
            together.run(x, start, forces, scratch);
        }
        forces
    }
}

/// Some trajectories in lockstep: row by row the numbers of [`FusedEngine::advance`], bit for bit.
struct Together<'a> {
    engine: &'a FusedEngine,
    field: super::perceptron::Batched<'a>,
    samples: usize,
    buffers: Buffers,
    /// Memory of each row.
    memory: Vec<f64>,
    /// Field input, force, slope and change of each row.
    input: Vec<f32>,
    now: Vec<f32>,
    slope: Vec<f32>,
    change: Vec<f32>,
}

impl<'a> Together<'a> {
    fn new(engine: &'a FusedEngine, samples: usize) -> Self {
        Self {
            engine,
            field: engine.field.batched(),
            samples,
            buffers: Buffers::default(),
            memory: Vec::new(),
            input: Vec::new(),
            now: Vec::new(),
            slope: Vec::new(),
            change: Vec::new(),
        }
    }

    /// x [rows, T, n], F_0 [rows, f] -> F [rows, T, f].
    fn run(&mut self, x: &[f64], start: &[f64], forces: &mut [f64], scratch: &mut Scratch) {
        let engine = self.engine;
        let (inputs, outputs) = (engine.inputs(), engine.outputs());
        let rows = start.len() / outputs;
        let memory = engine.memory_len();
        self.memory.resize(rows * memory, 0.0);
        self.input.resize(rows * engine.field.config.inputs, 0.0);
        for numbers in [&mut self.now, &mut self.slope, &mut self.change] {
            numbers.resize(rows * outputs, 0.0);
        }
        let mut carried = start.to_vec();
        let samples = self.samples;
        let put = |forces: &mut [f64], sample: usize, values: &[f64]| {
            for (row, values) in values.chunks_exact(outputs).enumerate() {
                forces[(row * samples + sample) * outputs..][..outputs].copy_from_slice(values);
            }
        };
        for sample in 0..samples {
            for (row, memory) in self.memory.chunks_exact_mut(memory).enumerate() {
                let x = &x[(row * samples + sample) * inputs..][..inputs];
                if sample == 0 {
                    engine.start(x, memory);
                } else {
                    engine.observe(x, memory);
                }
            }
            if engine.ode.is_some() {
                put(forces, sample, &carried);
            }
            self.step(&mut carried, scratch);
            if engine.ode.is_none() {
                put(forces, sample, &carried);
            }
        }
    }

    /// `carried` [rows, f] becomes the force at the next sample, or g(x).
    fn step(&mut self, carried: &mut [f64], scratch: &mut Scratch) {
        let Self {
            engine,
            field,
            buffers,
            memory,
            input,
            now,
            slope,
            change,
            ..
        } = self;
        let outputs = engine.outputs();
        let width = engine.field.config.inputs;
        let normaliser = &engine.normaliser;
        let rows = || memory.chunks_exact(engine.memory_len());
        match &engine.ode {
            None => {
                for (input, memory) in input.chunks_exact_mut(width).zip(rows()) {
                    for (slot, z) in input.iter_mut().zip(&memory[1..]) {
                        *slot = *z as f32;
                    }
                }
                field.evaluate(input, now, buffers);
            }
            Some(ode) => {
                let scratch = scratch.take(ode.past.scratch());
                let sees = width - ode.past.latent_len();
                for (input, memory) in input.chunks_exact_mut(width).zip(rows()) {
                    ode.past
                        .latent(engine.arch, memory, &mut input[sees..], scratch);
                }
                for (index, (now, carried)) in now.iter_mut().zip(carried.iter()).enumerate() {
                    *now = normaliser.force(index % outputs, *carried);
                }
                let tableau = ode.tableau();
                slope.fill(0.0);
                change.fill(0.0);
                for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
                    for ((input, now), slope) in input
                        .chunks_exact_mut(width)
                        .zip(now.chunks_exact(outputs))
                        .zip(slope.chunks_exact(outputs))
                    {
                        for ((slot, now), slope) in input[..sees].iter_mut().zip(now).zip(slope) {
                            *slot = now + *along as f32 * slope;
                        }
                    }
                    field.evaluate(input, slope, buffers);
                    for (change, slope) in change.iter_mut().zip(slope.iter()) {
                        *change += *weight as f32 * slope;
                    }
                }
                for (now, change) in now.iter_mut().zip(change.iter()) {
                    *now += *change;
                }
            }
        }
        for (index, (carried, now)) in carried.iter_mut().zip(now.iter()).enumerate() {
            *carried = normaliser.to_si(index % outputs, *now);
        }
    }
}
