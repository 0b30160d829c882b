//! Engine of any model in Candle's operations at batch 1: the reference for the fused engines.
//!
//! Only plain operations on one row: Candle's products stay below the size from which they start threads in
//! the host process. Memory: the window's raw samples [W, n], oldest first, and the state of a Relaxation-ODE, an LSTM
//! or a CNODE, or whether the newest sample is the first of an Attention-ODE that steps by the sample at the end.

use candle_core::{Device, Result, Tensor};

use super::interface::{Engine, SETTLED, SETTLING_STEPS, Scratch};
use crate::{
    architectures::{Network, cnode::STATE_LIMIT},
    force_model::ForceModel,
};

/// The engine; see the module.
#[derive(Clone, Debug)]
pub(super) struct CandleEngine(pub(super) ForceModel);

/// The parts of a memory.
struct Parts<'a> {
    window: &'a [f64],
    state: &'a [f64],
}

impl CandleEngine {
    /// Index of the state in the memory, after the window.
    fn state_at(&self) -> usize {
        self.0.window() * self.0.inputs()
    }

    fn parts<'a>(&self, memory: &'a [f64]) -> Parts<'a> {
        let (window, state) = memory.split_at(self.state_at());
        Parts { window, state }
    }

    /// z [W, n] of a raw window.
    fn window_tensor(&self, window: &[f64]) -> Result<Tensor> {
        let encoder = &self.0.encoder;
        let mut values = vec![0.0f32; window.len() / encoder.inputs() * encoder.len()];
        for (x, z) in window
            .chunks_exact(encoder.inputs())
            .zip(values.chunks_exact_mut(encoder.len()))
        {
            encoder.encode(x, |i, value| z[i] = self.0.normaliser.input(i, value));
        }
        Tensor::from_vec(
            values,
            (window.len() / encoder.inputs(), encoder.len()),
            &Device::Cpu,
        )
    }

    /// `next` of [`Engine::sample`] from `force` [f], both standardised.
    fn next(&self, memory: &Parts<'_>, force: &[f32]) -> Result<Vec<f32>> {
        let z = self.window_tensor(memory.window)?;
        let force = Tensor::from_slice(force, (1, force.len()), &Device::Cpu)?;
        let next = match &self.0.network {
            // At a first sample no step has led to the force yet.
            Network::AttentionOde(_) if memory.state.first() == Some(&1.0) => force,
            Network::AttentionOde(network) => {
                let latent = network.single_latent(&z)?;
                network.ode.step(&force, &latent, self.0.solver)?
            }
            Network::MlpOde(network) => {
                let latent = network.latent.forward(&z)?;
                network.ode.step(&force, &latent, self.0.solver)?
            }
            Network::RelaxationOde(network) => network.step(&row(memory.state, &z)?, &force)?,
            Network::Lstm(network) => {
                let width = network.layers.last().map_or(0, |layer| layer.width());
                let last = memory.state.len() - 2 * width;
                let h = row(&memory.state[last..][..width], &z)?;
                network.read(&h, &z.narrow(0, z.dim(0)? - 1, 1)?)?
            }
            Network::Cnode(_) => row(&memory.state[..self.0.outputs()], &z)?,
            Network::Mlp(mlp) => mlp.field.forward(&z)?,
        };
        next.flatten_all()?.to_vec1()
    }

    /// [`CandleEngine::next`], with NaN in place of an error. Products of checked shapes do not fail; if one did, the
    /// caller's check of its state would hold the force at zero.
    fn next_or_nan(&self, memory: &Parts<'_>, force: &[f32]) -> Vec<f32> {
        self.next(memory, force)
            .unwrap_or_else(|_| vec![f32::NAN; force.len()])
    }

    /// The state at a first sample, of the window that holds nothing else, where the force is `force` [f].
    fn first_state(&self, window: &[f64], force: &[f64], state: &mut [f64]) -> Result<()> {
        let z = self.window_tensor(window)?;
        let sample = z.narrow(0, 0, 1)?;
        let standard: Vec<f32> = (0..force.len())
            .map(|i| self.0.normaliser.force(i, force[i]))
            .collect();
        let force = Tensor::from_vec(standard, (1, force.len()), &Device::Cpu)?;
        match &self.0.network {
            Network::AttentionOde(_) => {
                state.fill(1.0);
                Ok(())
            }
            Network::RelaxationOde(network) => keep(&network.start(&z)?, state),
            Network::Lstm(network) => network.observe(&sample, state),
            Network::Cnode(network) => keep(&network.start(&force, &sample)?, state),
            _ => Ok(()),
        }
    }

    /// The state one sample on: the window before and the new sample, raw [W+1, n].
    fn next_state(&self, samples: &[f64], state: &mut [f64]) -> Result<()> {
        let z = self.window_tensor(samples)?;
        match &self.0.network {
            Network::AttentionOde(_) => {
                state.fill(0.0);
                Ok(())
            }
            Network::RelaxationOde(network) => {
                let newest = z.narrow(0, 1, self.0.window())?;
                keep(&network.follow(&row(state, &z)?, &newest)?, state)
            }
            Network::Lstm(network) => network.observe(&z.narrow(0, z.dim(0)? - 1, 1)?, state),
            Network::Cnode(network) => {
                let before = row(state, &z)?;
                let after = network.follow(&before, &z, self.0.solver)?;
                keep(&after.clamp(-STATE_LIMIT, STATE_LIMIT)?, state)
            }
            _ => Ok(()),
        }
    }
}

/// A state's numbers as one row [1, n], of the kind that `like` has.
fn row(state: &[f64], like: &Tensor) -> Result<Tensor> {
    Tensor::from_slice(state, (1, state.len()), like.device())?.to_dtype(like.dtype())
}

/// Writes a tensor's numbers into a state.
fn keep(tensor: &Tensor, state: &mut [f64]) -> Result<()> {
    let values = tensor.to_dtype(candle_core::DType::F64)?.flatten_all()?;
    state.copy_from_slice(&values.to_vec1::<f64>()?);
    Ok(())
}

impl Engine for CandleEngine {
    fn inputs(&self) -> usize {
        self.0.inputs()
    }

    fn outputs(&self) -> usize {
        self.0.outputs()
    }

    fn memory_len(&self) -> usize {
        self.state_at()
            + match &self.0.network {
                Network::AttentionOde(network) => usize::from(network.config().end_of_step),
                Network::RelaxationOde(network) => network.state_len(self.0.outputs()),
                Network::Lstm(network) => network.memory_len(),
                Network::Cnode(network) => network.field.config().inputs,
                _ => 0,
            }
    }

    fn start(&self, x: &[f64], force: &[f64], memory: &mut [f64], _: &mut Scratch) {
        let (window, state) = memory.split_at_mut(self.state_at());
        for slot in window.chunks_exact_mut(x.len()) {
            slot.copy_from_slice(x);
        }
        state.fill(0.0);
        if self.first_state(window, force, state).is_err() {
            state.fill(f64::NAN);
        }
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], _: &mut Scratch) {
        let (window, state) = memory.split_at_mut(self.state_at());
        if self.next_state(&[&*window, x].concat(), state).is_err() {
            state.fill(f64::NAN);
        }
        window.copy_within(x.len().., 0);
        let newest = window.len() - x.len();
        window[newest..].copy_from_slice(x);
    }

    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        _: &mut Scratch,
    ) {
        let normaliser = &self.0.normaliser;
        let standard: Vec<f32> = force
            .iter()
            .enumerate()
            .map(|(i, v)| normaliser.force(i, *v))
            .collect();
        let found = self.next_or_nan(&self.parts(memory), &standard);
        for (i, (slot, value)) in next.iter_mut().zip(found).enumerate() {
            *slot = normaliser.to_si(i, value);
        }
        now.copy_from_slice(if self.0.predicts_next() { force } else { next });
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut memory = vec![0.0; self.memory_len()];
        let mean = self.0.normaliser.output_mean.clone();
        self.start(x, &mean, &mut memory, scratch);
        if self.0.config.steps_a_field() {
            // The force of many steps, not of the first sample.
            memory[self.state_at()..].fill(0.0);
        }
        let parts = self.parts(&memory);
        let mut now = vec![0.0f32; force.len()];
        if let Network::RelaxationOde(network) = &self.0.network {
            let target = self
                .window_tensor(parts.window)
                .and_then(|z| network.settled(&z)?.flatten_all()?.to_vec1());
            now = target.unwrap_or_else(|_| vec![f32::NAN; force.len()]);
        } else if let Network::Cnode(network) = &self.0.network {
            let found = self.window_tensor(parts.window).and_then(|z| {
                network
                    .estimate
                    .forward(&z.narrow(0, 0, 1)?)?
                    .flatten_all()?
                    .to_vec1()
            });
            now = found.unwrap_or_else(|_| vec![f32::NAN; force.len()]);
        } else {
            for _ in 0..SETTLING_STEPS {
                let next = self.next_or_nan(&parts, &now);
                let settled = now.iter().zip(&next).all(|(a, b)| (a - b).abs() < SETTLED);
                now = next;
                if settled || !self.0.config.steps_a_field() {
                    break;
                }
            }
        }
        for (i, (slot, value)) in force.iter_mut().zip(now).enumerate() {
            *slot = self.0.normaliser.to_si(i, value);
        }
    }
}
