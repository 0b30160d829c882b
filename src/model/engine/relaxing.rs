//! A Relaxation-ODE: targets and rates by our own products, then the exact step of every mode.
//!
//! Memory: a ring as [`super::past`] has it, and the modes S [J f] (standardised). What is carried as the force is in them.

use pulp::Arch;

use super::{
    super::{
        ForceModel, ModelError,
        kernel::sigmoid,
        relaxation_ode::{RelaxationOde, slower},
    },
    BLOCK, Engine, Scratch, past,
    perceptron::{Buffers, Perceptron, Precision},
    samples,
    units::Units,
};

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct RelaxingEngine {
    arch: Arch,
    units: Units,
    window: usize,
    modes: usize,
    /// h [W n] -> [T; kappa], kappa as it is before modes are told apart [2 J f].
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
            modes: ode.modes,
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

    /// Numbers of the ring, before those of the modes.
    fn ring_len(&self) -> usize {
        past::memory_len(self.window, self.units.encoded())
    }

    /// [T; share of the way] [2 J f] of a ring.
    fn evaluate<'a>(&self, ring: &[f64], scratch: &'a mut Scratch) -> &'a [f32] {
        let (width, inputs) = (self.units.encoded(), self.field.config.inputs);
        let found = self.field.config.outputs;
        let scratch = scratch.take(inputs + found + self.field.scratch());
        let (h, rest) = scratch.split_at_mut(inputs);
        let (found, layers) = rest.split_at_mut(found);
        let newest = past::newest(ring, self.window);
        self.latent(h, |lag, i| {
            let slot = (newest + self.window - lag) % self.window;
            ring[1 + slot * width + i] as f32
        });
        self.field.evaluate(self.arch, h, found, layers);
        self.share(found);
        found
    }

    /// [T; kappa] -> [T; share of the way] [2 J f].
    fn share(&self, found: &mut [f32]) {
        let (_, kappa) = found.split_at_mut(found.len() / 2);
        let outputs = kappa.len() / self.modes;
        for (mode, kappa) in kappa.chunks_exact_mut(outputs).enumerate() {
            for kappa in kappa {
                *kappa -= slower(mode);
            }
        }
        sigmoid(self.arch, kappa);
    }

    /// S [J f] at the start, where the force is `force` [f] (SI).
    fn begin(&self, force: &[f64], found: &[f32], modes: &mut [f64]) {
        let (first, settled) = modes.split_at_mut(force.len());
        for (mode, target) in settled.iter_mut().zip(&found[force.len()..]) {
            *mode = f64::from(*target);
        }
        for (i, first) in first.iter_mut().enumerate() {
            let whole = self.units.normaliser.force(i, force[i]);
            let rest = settled.iter().skip(i).step_by(force.len());
            *first = f64::from(rest.fold(whole, |left, mode| left - *mode as f32));
        }
    }

    /// S [J f] after a step.
    fn relax(modes: &mut [f64], found: &[f32]) {
        let (target, share) = found.split_at(modes.len());
        for (mode, (target, share)) in modes.iter_mut().zip(target.iter().zip(share)) {
            let before = *mode as f32;
            *mode = f64::from(before + share * (target - before));
        }
    }

    /// The force [f] (SI) of modes [J f], or what their targets sum up to.
    fn force(&self, modes: impl Iterator<Item = f32> + Clone, force: &mut [f64]) {
        let outputs = force.len();
        let sum = |i| modes.clone().skip(i).step_by(outputs).sum();
        self.units.to_si((0..outputs).map(sum), force);
    }
}

impl Engine for RelaxingEngine {
    fn inputs(&self) -> usize {
        self.units.features()
    }

    fn outputs(&self) -> usize {
        self.field.config.outputs / (2 * self.modes)
    }

    fn memory_len(&self) -> usize {
        self.ring_len() + self.field.config.outputs / 2
    }

    fn start(&self, x: &[f64], force: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let (ring, modes) = memory.split_at_mut(self.ring_len());
        past::fill(ring, self.units.encoded(), |z| self.units.encode(x, z));
        self.begin(force, self.evaluate(ring, scratch), modes);
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let (ring, modes) = memory.split_at_mut(self.ring_len());
        past::push(ring, self.units.encoded(), |z| self.units.encode(x, z));
        Self::relax(modes, self.evaluate(ring, scratch));
    }

    fn sample(
        &self,
        memory: &[f64],
        _: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        _: &mut Scratch,
    ) {
        self.force(
            memory[self.ring_len()..].iter().map(|mode| *mode as f32),
            now,
        );
        next.copy_from_slice(now);
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut ring = vec![0.0; self.ring_len()];
        past::fill(&mut ring, self.units.encoded(), |z| self.units.encode(x, z));
        let found = self.evaluate(&ring, scratch);
        self.force(found[..found.len() / 2].iter().copied(), force);
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
        let mut forces = vec![0.0; samples * start.len()];
        let mut z = vec![0.0f32; samples * width];
        let (mut h, mut found) = (Vec::new(), Vec::new());
        let mut modes = vec![0.0; self.modes * outputs];
        for ((x, start), forces) in x
            .chunks_exact((samples * inputs).max(1))
            .zip(start.chunks_exact(outputs))
            .zip(forces.chunks_exact_mut((samples * outputs).max(1)))
        {
            self.units.encode(x, &mut z);
            for (block, forces) in forces.chunks_mut(BLOCK * outputs).enumerate() {
                let first = block * BLOCK;
                let rows = forces.len() / outputs;
                h.resize(rows * self.field.config.inputs, 0.0);
                found.resize(rows * self.field.config.outputs, 0.0);
                for (row, h) in h.chunks_exact_mut(self.field.config.inputs).enumerate() {
                    self.latent(h, |lag, i| z[(first + row).saturating_sub(lag) * width + i]);
                }
                field.evaluate(self.arch, &h, &mut found, &mut buffers);
                for (row, (found, force)) in found
                    .chunks_exact_mut(self.field.config.outputs)
                    .zip(forces.chunks_exact_mut(outputs))
                    .enumerate()
                {
                    self.share(found);
                    if first + row == 0 {
                        self.begin(start, found, &mut modes);
                    } else {
                        Self::relax(&mut modes, found);
                    }
                    self.force(modes.iter().map(|mode| *mode as f32), force);
                }
            }
        }
        Ok(forces)
    }
}
