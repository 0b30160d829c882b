//! Engine of the Relaxation-ODE: targets and rates by the products of this crate, then the exact step of every mode.
//!
//! A step is an affine map of the previous force, so if the caller clamps that force, the first mode relaxes from the
//! clamped one:
//!
//! ```text
//! F_k = a F_{k-1} + b,   a = 1 - s_1,   b = s_1 T_1 - a R_{k-1} + R_k,   R = S_2 + .. + S_J
//! ```
//!
//! Memory: a ring ([`super::sample_ring`]), then the M numbers of the model's own memory, S_2 .. S_J, a and b, M + (J + 1) f numbers
//! (standardised). At a first sample the map is the identity.

use pulp::Arch;

use super::{
    interface::{BLOCK, Engine, Scratch, samples},
    packed_perceptron::{Buffers, PackedPerceptron, Precision},
    sample_ring,
    units::Units,
};
use crate::{
    architectures::{
        relaxation_ode::{RelaxationOde, kappa_offset},
        relaxing_memory::lambda_offset,
    },
    error::ModelError,
    force_model::ForceModel,
    kernel::sigmoid,
};

/// The engine; see the module.
#[derive(Clone, Debug)]
pub(super) struct RelaxationEngine {
    arch: Arch,
    units: Units,
    window: usize,
    modes: usize,
    /// h [W n] -> [G; lambda], lambda as it is before numbers are told apart [2 M]; none without a memory.
    memory: Option<PackedPerceptron>,
    /// h [W n], m [M] -> [T; kappa], kappa as it is before modes are told apart [2 J f].
    field: PackedPerceptron,
}

impl RelaxationEngine {
    pub(super) fn new(
        model: &ForceModel,
        ode: &RelaxationOde,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        let memory = ode.memory.as_ref();
        let memory = memory.map(|memory| PackedPerceptron::new(&memory.field, precision));
        Ok(Self {
            arch,
            units: Units::from_model(model),
            window: ode.window,
            modes: ode.modes,
            memory: memory.transpose()?,
            field: PackedPerceptron::new(&ode.field, precision)?,
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

    /// Numbers of the ring; what comes behind it is the state.
    fn ring_len(&self) -> usize {
        sample_ring::memory_len(self.window, self.units.encoded())
    }

    /// Numbers M of the model's own memory.
    fn numbers(&self) -> usize {
        self.memory.as_ref().map_or(0, |of| of.config.outputs / 2)
    }

    /// Numbers of the state [S_2 .. S_J; a; b].
    fn state_len(&self) -> usize {
        (self.modes + 1) * self.outputs()
    }

    /// A memory of the engine in its parts: ring, numbers, state.
    fn parts<'a>(&self, memory: &'a mut [f64]) -> (&'a mut [f64], &'a mut [f64], &'a mut [f64]) {
        let (ring, rest) = memory.split_at_mut(self.ring_len());
        let (numbers, state) = rest.split_at_mut(self.numbers());
        (ring, numbers, state)
    }

    /// [T; share of the way] [2 J f] of a ring; the memory's `numbers` are led on to it, or settle at a first sample.
    fn evaluate<'a>(
        &self,
        (ring, numbers): (&[f64], &mut [f64]),
        is_first: bool,
        scratch: &'a mut Scratch,
    ) -> &'a [f32] {
        let (width, inputs) = (self.units.encoded(), self.field.config.inputs);
        let (found, led) = (self.field.config.outputs, 2 * numbers.len());
        let of_memory = self.memory.as_ref().map_or(0, PackedPerceptron::scratch);
        let layers = self.field.scratch().max(of_memory);
        let scratch = scratch.take(inputs + found + led + layers);
        let (h, rest) = scratch.split_at_mut(inputs);
        let (found, rest) = rest.split_at_mut(found);
        let (led, layers) = rest.split_at_mut(led);
        let (motion, remembered) = h.split_at_mut(inputs - numbers.len());
        let newest = sample_ring::newest(ring, self.window);
        self.latent(motion, |lag, i| {
            let slot = (newest + self.window - lag) % self.window;
            ring[1 + slot * width + i] as f32
        });
        if let Some(memory) = &self.memory {
            memory.evaluate(self.arch, motion, led, layers);
            self.lead(led, is_first, numbers, remembered);
        }
        self.field.evaluate(self.arch, h, found, layers);
        self.share(found);
        found
    }

    /// Leads the memory's numbers to a sample, by its [G; lambda]; they are left in `remembered` too.
    fn lead(&self, led: &mut [f32], is_first: bool, numbers: &mut [f64], remembered: &mut [f32]) {
        let (target, lambda) = led.split_at_mut(numbers.len());
        for (at, lambda) in lambda.iter_mut().enumerate() {
            *lambda -= lambda_offset(at, numbers.len());
        }
        sigmoid(self.arch, lambda);
        let all = numbers.iter_mut().zip(remembered).zip(target).zip(lambda);
        for (((number, remembered), target), share) in all {
            let share = if is_first { 1.0 } else { f64::from(*share) };
            *number += share * (f64::from(*target) - *number);
            *remembered = *number as f32;
        }
    }

    /// [T; kappa] -> [T; share of the way] [2 J f].
    fn share(&self, found: &mut [f32]) {
        let (_, kappa) = found.split_at_mut(found.len() / 2);
        for (mode, kappa) in kappa.chunks_exact_mut(self.outputs()).enumerate() {
            for kappa in kappa {
                *kappa -= kappa_offset(mode);
            }
        }
        sigmoid(self.arch, kappa);
    }

    /// The state at a first sample.
    fn begin(&self, found: &[f32], state: &mut [f64]) {
        let outputs = self.outputs();
        let (settled, map) = state.split_at_mut((self.modes - 1) * outputs);
        for (mode, target) in settled.iter_mut().zip(&found[outputs..]) {
            *mode = f64::from(*target);
        }
        let (a, b) = map.split_at_mut(outputs);
        a.fill(1.0);
        b.fill(0.0);
    }

    /// The state one sample on.
    fn follow(&self, found: &[f32], state: &mut [f64]) {
        let outputs = self.outputs();
        let (target, share) = found.split_at(self.modes * outputs);
        let (slower, map) = state.split_at_mut((self.modes - 1) * outputs);
        let (a, b) = map.split_at_mut(outputs);
        for i in 0..outputs {
            let share_of = |mode: usize| f64::from(share[mode * outputs + i]);
            let target_of = |mode: usize| f64::from(target[mode * outputs + i]);
            a[i] = 1.0 - share_of(0);
            b[i] = share_of(0) * target_of(0);
            for (mode, slower) in slower.iter_mut().skip(i).step_by(outputs).enumerate() {
                let before = *slower;
                *slower += share_of(mode + 1) * (target_of(mode + 1) - before);
                b[i] += *slower - a[i] * before;
            }
        }
    }

    /// The force [f] (SI) at the sample of `state`, from that which was carried to it.
    fn step(&self, state: &[f64], force: &mut [f64]) {
        let outputs = force.len();
        let (a, b) = state[(self.modes - 1) * outputs..].split_at(outputs);
        let normaliser = &self.units.normaliser;
        for (i, force) in force.iter_mut().enumerate() {
            let (mean, std) = (normaliser.output_mean[i], normaliser.output_std[i]);
            *force = mean + a[i] * (*force - mean) + b[i] * std;
        }
    }
}

impl Engine for RelaxationEngine {
    fn inputs(&self) -> usize {
        self.units.features()
    }

    fn outputs(&self) -> usize {
        self.field.config.outputs / (2 * self.modes)
    }

    fn memory_len(&self) -> usize {
        self.ring_len() + self.numbers() + self.state_len()
    }

    fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let (ring, numbers, state) = self.parts(memory);
        sample_ring::fill(ring, self.units.encoded(), |z| self.units.encode(x, z));
        // What stood there is of another start, and may be anything.
        numbers.fill(0.0);
        self.begin(self.evaluate((ring, numbers), true, scratch), state);
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let (ring, numbers, state) = self.parts(memory);
        sample_ring::push(ring, self.units.encoded(), |z| self.units.encode(x, z));
        self.follow(self.evaluate((ring, numbers), false, scratch), state);
    }

    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        _: &mut Scratch,
    ) {
        now.copy_from_slice(force);
        self.step(&memory[self.ring_len() + self.numbers()..], now);
        next.copy_from_slice(now);
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut ring = vec![0.0; self.ring_len()];
        sample_ring::fill(&mut ring, self.units.encoded(), |z| self.units.encode(x, z));
        let mut numbers = vec![0.0; self.numbers()];
        let found = self.evaluate((&ring, &mut numbers), true, scratch);
        let target = &found[..self.modes * force.len()];
        let outputs = force.len();
        let sum = |i| target.iter().skip(i).step_by(outputs).sum();
        self.units.to_si((0..outputs).map(sum), force);
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
        let memory = self.memory.as_ref().map(PackedPerceptron::batched);
        let (mut motion, mut led) = (Vec::new(), Vec::new());
        let mut numbers = vec![0.0; self.numbers()];
        let motion_len = self.field.config.inputs - numbers.len();
        let mut forces = Vec::with_capacity(samples * start.len());
        let mut z = vec![0.0f32; samples * width];
        let (mut h, mut found) = (Vec::new(), Vec::new());
        let mut state = vec![0.0; self.state_len()];
        for (x, start) in x
            .chunks_exact((samples * inputs).max(1))
            .zip(start.chunks_exact(outputs))
        {
            self.units.encode(x, &mut z);
            let mut force = start.to_vec();
            numbers.fill(0.0);
            for first in (0..samples).step_by(BLOCK) {
                let rows = BLOCK.min(samples - first);
                h.resize(rows * self.field.config.inputs, 0.0);
                found.resize(rows * self.field.config.outputs, 0.0);
                for (row, h) in h.chunks_exact_mut(self.field.config.inputs).enumerate() {
                    let motion = &mut h[..motion_len];
                    self.latent(motion, |lag, i| {
                        z[(first + row).saturating_sub(lag) * width + i]
                    });
                }
                if let Some(memory) = &memory {
                    motion.clear();
                    for h in h.chunks_exact(self.field.config.inputs) {
                        motion.extend_from_slice(&h[..motion_len]);
                    }
                    led.resize(rows * 2 * numbers.len(), 0.0);
                    memory.evaluate(self.arch, &motion, &mut led, &mut buffers);
                    let rows = h.chunks_exact_mut(self.field.config.inputs);
                    let led = led.chunks_exact_mut(2 * numbers.len());
                    for (row, (h, led)) in rows.zip(led).enumerate() {
                        let is_first = first + row == 0;
                        self.lead(led, is_first, &mut numbers, &mut h[motion_len..]);
                    }
                }
                field.evaluate(self.arch, &h, &mut found, &mut buffers);
                for (row, found) in found
                    .chunks_exact_mut(self.field.config.outputs)
                    .enumerate()
                {
                    self.share(found);
                    if first + row == 0 {
                        self.begin(found, &mut state);
                    } else {
                        self.follow(found, &mut state);
                    }
                    self.step(&state, &mut force);
                    forces.extend_from_slice(&force);
                }
            }
        }
        Ok(forces)
    }
}
