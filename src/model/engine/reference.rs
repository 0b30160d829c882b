//! A model stepped through Candle at batch 1: the reference for the fused engine.
//!
//! Only plain operations on one row: Candle's products stay below the size from which they start threads in
//! the host process. Memory: the window's raw samples [W, n], oldest first.

use candle_core::{Device, Result, Tensor};

use super::{
    super::{ForceModel, Network},
    Engine, SETTLED, SETTLING_STEPS, Scratch,
};

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct CandleEngine(pub(crate) ForceModel);

impl CandleEngine {
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

    /// What follows `force` (standardised), or g(x).
    fn next(&self, window: &[f64], force: &[f32]) -> Result<Vec<f32>> {
        let z = self.window_tensor(window)?;
        let next = match &self.0.network {
            Network::AttentionOde(ode) => {
                let force = Tensor::from_slice(force, (1, force.len()), &Device::Cpu)?;
                ode.step(&force, &ode.single_latent(&z)?, self.0.solver)?
            }
            Network::Mlp(mlp) => mlp.field.forward(&z)?,
        };
        next.flatten_all()?.to_vec1()
    }

    /// A product of checked shapes does not fail; were it to, the force is not a number and the caller's own check
    /// of its state holds it at zero.
    fn next_or_nan(&self, window: &[f64], force: &[f32]) -> Vec<f32> {
        self.next(window, force)
            .unwrap_or_else(|_| vec![f32::NAN; force.len()])
    }
}

impl Engine for CandleEngine {
    fn inputs(&self) -> usize {
        self.0.inputs()
    }

    fn outputs(&self) -> usize {
        self.0.outputs()
    }

    fn memory_len(&self) -> usize {
        self.0.window() * self.0.inputs()
    }

    fn start(&self, x: &[f64], memory: &mut [f64]) {
        for slot in memory.chunks_exact_mut(x.len()) {
            slot.copy_from_slice(x);
        }
    }

    fn observe(&self, x: &[f64], memory: &mut [f64]) {
        memory.copy_within(x.len().., 0);
        let newest = memory.len() - x.len();
        memory[newest..].copy_from_slice(x);
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
        let found = self.next_or_nan(memory, &standard);
        for (i, (slot, value)) in next.iter_mut().zip(found).enumerate() {
            *slot = normaliser.to_si(i, value);
        }
        now.copy_from_slice(if self.0.has_memory() { force } else { next });
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], _: &mut Scratch) {
        let window = x.repeat(self.0.window());
        let mut now = vec![0.0f32; force.len()];
        for _ in 0..SETTLING_STEPS {
            let next = self.next_or_nan(&window, &now);
            let settled = now.iter().zip(&next).all(|(a, b)| (a - b).abs() < SETTLED);
            now = next;
            if settled || !self.0.has_memory() {
                break;
            }
        }
        for (i, (slot, value)) in force.iter_mut().zip(now).enumerate() {
            *slot = self.0.normaliser.to_si(i, value);
        }
    }
}
