//! A model stepped through Candle at batch 1: the reference for the fused engines.
//!
//! Only plain operations on one row: Candle's products stay below the size from which they start threads in
//! the host process. Memory: whether the first sample is the only one, the window's raw samples [W, n], oldest
//! first, and the state of an LSTM or a CNODE.

use candle_core::{Device, Result, Tensor};

use super::{
    super::{ForceModel, Network, cnode::STATE_LIMIT},
    Engine, SETTLED, SETTLING_STEPS, Scratch,
};

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct CandleEngine(pub(super) ForceModel);

/// The parts of a memory.
struct Parts<'a> {
    first: bool,
    window: &'a [f64],
    state: &'a [f64],
}

impl CandleEngine {
    /// Where the state's numbers begin.
    fn state_at(&self) -> usize {
        1 + self.0.window() * self.0.inputs()
    }

    fn parts<'a>(&self, memory: &'a [f64]) -> Parts<'a> {
        let (head, state) = memory.split_at(self.state_at());
        Parts {
            first: head[0] != 0.0,
            window: &head[1..],
            state,
        }
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

    /// What is carried on from `force` [f] (standardised).
    fn next(&self, memory: &Parts<'_>, force: &[f32]) -> Result<Vec<f32>> {
        let z = self.window_tensor(memory.window)?;
        let force = Tensor::from_slice(force, (1, force.len()), &Device::Cpu)?;
        let next = match &self.0.network {
            Network::AttentionOde(network) => {
                let latent = network.single_latent(&z)?;
                network.ode.step(&force, &latent, self.0.solver)?
            }
            Network::MlpOde(network) => {
                let latent = network.latent.forward(&z)?;
                network.ode.step(&force, &latent, self.0.solver)?
            }
            Network::RelaxationOde(_) if memory.first => force,
            Network::RelaxationOde(network) => {
                let (share, target) = network.single(&z)?;
                (&force + (share * (target - &force)?)?)?
            }
            Network::Lstm(network) => {
                let width = network.layers.last().map_or(0, |layer| layer.width());
                let last = memory.state.len() - 2 * width;
                let h = Tensor::from_slice(&memory.state[last..][..width], (1, width), z.device())?;
                network.read(&h.to_dtype(z.dtype())?, &z.narrow(0, z.dim(0)? - 1, 1)?)?
            }
            Network::Cnode(_) => {
                let force = memory.state[..force.dim(1)?].to_vec();
                Tensor::from_vec(force, (1, self.0.outputs()), z.device())?.to_dtype(z.dtype())?
            }
            Network::Mlp(mlp) => mlp.field.forward(&z)?,
        };
        next.flatten_all()?.to_vec1()
    }

    /// A product of checked shapes does not fail; were it to, the force is not a number and the caller's own check
    /// of its state holds it at zero.
    fn next_or_nan(&self, memory: &Parts<'_>, force: &[f32]) -> Vec<f32> {
        self.next(memory, force)
            .unwrap_or_else(|_| vec![f32::NAN; force.len()])
    }

    /// The state at a first sample x [n], where the force is `force` [f].
    fn first_state(&self, x: &[f64], force: &[f64], state: &mut [f64]) -> Result<()> {
        match &self.0.network {
            Network::Lstm(network) => network.observe(&self.window_tensor(x)?, state),
            Network::Cnode(network) => {
                let standard: Vec<f32> = (0..force.len())
                    .map(|i| self.0.normaliser.force(i, force[i]))
                    .collect();
                let force = Tensor::from_vec(standard, (1, force.len()), &Device::Cpu)?;
                keep(&network.start(&force, &self.window_tensor(x)?)?, state)
            }
            _ => Ok(()),
        }
    }

    /// The state one sample on: the window before and the new sample, raw [W+1, n].
    fn next_state(&self, samples: &[f64], state: &mut [f64]) -> Result<()> {
        let z = self.window_tensor(samples)?;
        match &self.0.network {
            Network::Lstm(network) => network.observe(&z.narrow(0, z.dim(0)? - 1, 1)?, state),
            Network::Cnode(network) => {
                let before = Tensor::from_slice(state, (1, state.len()), &Device::Cpu)?;
                let before = before.to_dtype(z.dtype())?;
                let after = network.follow(&before, &z, self.0.solver)?;
                keep(&after.clamp(-STATE_LIMIT, STATE_LIMIT)?, state)
            }
            _ => Ok(()),
        }
    }
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
                Network::Lstm(network) => network.memory_len(),
                Network::Cnode(network) => network.field.config().inputs,
                _ => 0,
            }
    }

    fn start(&self, x: &[f64], force: &[f64], memory: &mut [f64], _: &mut Scratch) {
        let (head, state) = memory.split_at_mut(self.state_at());
        head[0] = 1.0;
        for slot in head[1..].chunks_exact_mut(x.len()) {
            slot.copy_from_slice(x);
        }
        state.fill(0.0);
        if self.first_state(x, force, state).is_err() {
            state.fill(f64::NAN);
        }
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], _: &mut Scratch) {
        let (head, state) = memory.split_at_mut(self.state_at());
        head[0] = 0.0;
        let window = &mut head[1..];
        if self.next_state(&[window, x].concat(), state).is_err() {
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
        let parts = self.parts(&memory);
        let mut now = vec![0.0f32; force.len()];
        if let Network::RelaxationOde(network) = &self.0.network {
            let target = self
                .window_tensor(parts.window)
                .and_then(|z| network.single(&z)?.1.flatten_all()?.to_vec1());
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
                if settled || !self.0.predicts_next() {
                    break;
                }
            }
        }
        for (i, (slot, value)) in force.iter_mut().zip(now).enumerate() {
            *slot = self.0.normaliser.to_si(i, value);
        }
    }
}
