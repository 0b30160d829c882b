//! A field, the latent that drives it and the step of its differential equation, for one row or for many.

use pulp::Arch;

use super::{
    attention_cache::AttentionCache,
    feature_latent::FeatureLatent,
    latent::Latent,
    packed_perceptron::{PackedPerceptron, Precision},
    sample_ring,
    units::Units,
};
use crate::{
    architectures::{Network, attention_ode::Sight},
    force_model::ForceModel,
    solver::{
        Solver,
        dormand_prince::{Clock, Period, STAGES},
    },
};

/// Units, field, latent and solver of a model whose force follows a differential equation.
#[derive(Clone, Debug)]
pub(super) struct FieldStepper {
    /// The instructions of this machine, or those that a test asks for.
    pub(super) arch: Arch,
    pub(super) units: Units,
    pub(super) field: PackedPerceptron,
    pub(super) ode: Ode,
    /// True if the sample at its end drives a step; the memory then ends with 1 at a first sample, else 0.
    pub(super) end_of_step: bool,
}

/// The differential equation: solver, latent, and whether the field reads the force.
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

    /// Steps the forces by one sample period. Each row of `input` [rows, inputs] holds the place of the force followed by h;
    /// `evaluate` is the field of some rows. Adaptive steps of more than one row overwrite h.
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
    /// Slopes of [`Ode::slopes`] stages.
    pub(super) slope: &'a mut [f32],
    pub(super) change: &'a mut [f32],
    /// [rows].
    pub(super) clocks: &'a mut [Clock],
}

impl FieldStepper {
    pub(super) fn new(
        model: &ForceModel,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        let mut end_of_step = false;
        let (ode, latent) = match &model.network {
            Network::AttentionOde(network) => {
                let config = network.config();
                end_of_step = config.end_of_step;
                let latent = match &network.sight {
                    Sight::Samples(layers) => {
                        Latent::Attention(AttentionCache::new(config, layers)?)
                    }
                    Sight::Features(layers) => {
                        Latent::Features(FeatureLatent::new(config, layers)?)
                    }
                };
                (&network.ode, latent)
            }
            // Small beside the field, and what it makes drives the field: always in f32.
            Network::MlpOde(network) => {
                let latent = PackedPerceptron::new(&network.latent, Precision::Single)?;
                (&network.ode, Latent::Perceptron(latent))
            }
            other => candle_core::bail!("{other:?} is not stepped by a field"),
        };
        Ok(Self {
            arch,
            units: Units::from_model(model),
            field: PackedPerceptron::new(&ode.field, precision)?,
            ode: Ode {
                solver: model.solver,
                field_sees_force: ode.field_sees_force,
                latent,
            },
            end_of_step,
        })
    }

    /// Numbers of scratch in all: field input, force, slopes, layers, and what the latent takes.
    pub(super) fn scratch(&self) -> usize {
        let field = &self.field.config;
        let forces = 2 + self.ode.slopes();
        field.inputs + forces * field.outputs + self.field.scratch() + self.ode.latent.scratch()
    }

    /// Numbers of memory: the samples that the latent sees, and whether the newest is the first.
    pub(super) fn memory_len(&self) -> usize {
        self.ring_len() + usize::from(self.end_of_step)
    }

    fn ring_len(&self) -> usize {
        sample_ring::memory_len(self.ode.latent.window(), self.units.encoded())
    }

    /// The part of a memory that the latent reads.
    pub(super) fn ring<'a>(&self, memory: &'a [f64]) -> &'a [f64] {
        &memory[..self.ring_len()]
    }

    /// True where no step has led to the force yet, though the sample at its end drives it: the force is the first one.
    pub(super) fn is_first(&self, memory: &[f64]) -> bool {
        memory[self.ring_len()..].first() == Some(&1.0)
    }

    /// Memory of a past in which every sample was `x` [n].
    pub(super) fn start(&self, x: &[f64], memory: &mut [f64]) {
        let (ring, first) = memory.split_at_mut(self.ring_len());
        sample_ring::fill(ring, self.units.encoded(), |z| self.units.encode(x, z));
        first.fill(1.0);
    }

    /// Takes the next sample `x` [n] into the memory.
    pub(super) fn observe(&self, x: &[f64], memory: &mut [f64]) {
        let (ring, first) = memory.split_at_mut(self.ring_len());
        sample_ring::push(ring, self.units.encoded(), |z| self.units.encode(x, z));
        first.fill(0.0);
    }
}
