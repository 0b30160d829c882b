//! Windows of trajectories, cut anew every epoch, and the tensors of a batch.

use candle_core::{Device, Result, Tensor};
use hydro_model::{Encoder, Encoding, Normaliser, features::FeatureLayout};
use rand::{RngExt as _, SeedableRng as _, seq::SliceRandom as _};
use rand_chacha::ChaCha8Rng;

use super::{Labels, TrainConfig};
use crate::dataset::Split;

/// Where a window lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) trajectory: usize,
    /// First sample.
    pub(super) start: usize,
    /// True: the past is hidden, as at the start of a run.
    pub(super) cold: bool,
}

/// The windows of an epoch in their order: a function of the seed and the epoch alone.
///
/// Every trajectory is cut from a random first sample into windows that share their border sample, so all
/// phases of a trajectory come up as starts over the epochs.
pub(super) fn cut(config: &TrainConfig, split: &Split, epoch: usize) -> Vec<Window> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    // Stream 0 is left to others that use the bare seed.
    rng.set_stream(epoch as u64 + 1);
    let steps = config.horizon.min(split.samples()) - 1;
    let slack = (split.samples() - 1) - steps;
    let mut windows = Vec::new();
    for trajectory in 0..split.len() {
        let mut start = rng.random_range(0..=slack.min(steps - 1));
        while start + steps < split.samples() {
            let cold = rng.random_bool(config.cold_start);
            windows.push(Window {
                trajectory,
                start,
                cold,
            });
            start += steps;
        }
    }
    windows.shuffle(&mut rng);
    windows
}

/// How many steps every epoch has: the least that any cut gives.
pub(super) fn steps_per_epoch(config: &TrainConfig, split: &Split) -> usize {
    let steps = config.horizon.min(split.samples()) - 1;
    let last_start = (split.samples() - 1) - steps;
    let least = 1 + (last_start - last_start.min(steps - 1)) / steps;
    (split.len() * least).div_ceil(config.batch)
}

/// Turns windows into tensors.
#[derive(Clone, Debug)]
pub(super) struct Batcher<'a> {
    pub(super) split: &'a Split,
    pub(super) encoder: &'a Encoder,
    pub(super) normaliser: &'a Normaliser,
    /// Where the quaternion stands, when its sign reaches the network.
    pub(super) quaternion: Option<usize>,
    /// W - 1, samples of the past in front of a window.
    pub(super) past: usize,
    pub(super) labels: Labels,
}

/// z [B, W-1+N, n], F_0 [B, f], labels [B, N, f]; all standardised.
pub(super) struct Batch {
    pub(super) z: Tensor,
    pub(super) start: Tensor,
    pub(super) target: Tensor,
}

/// Where the quaternion's sign matters: it is canonical at the start of a window.
pub(super) fn signed_quaternion(encoding: &Encoding, layout: &FeatureLayout) -> Option<usize> {
    layout
        .quaternion()
        .filter(|_| !encoding.replaces_quaternion())
}

impl Batch {
    /// The same on a device.
    pub(super) fn to_device(&self, device: &Device) -> Result<Self> {
        Ok(Self {
            z: self.z.to_device(device)?,
            start: self.start.to_device(device)?,
            target: self.target.to_device(device)?,
        })
    }
}

impl Batcher<'_> {
    /// `samples` samples from the start of every window.
    pub(super) fn batch(&self, windows: &[Window], samples: usize) -> Result<Batch> {
        let (n, f, width) = (
            self.split.inputs(),
            self.split.outputs(),
            self.encoder.len(),
        );
        let rows = self.past + samples;
        let mut z = vec![0.0f32; windows.len() * rows * width];
        let mut target = Vec::with_capacity(windows.len() * samples * f);
        let mut sample = vec![0.0f64; n];
        for (window, z) in windows.iter().zip(z.chunks_exact_mut(rows * width)) {
            let x = self.split.x(window.trajectory);
            let first = if window.cold { window.start } else { 0 };
            let flip = self.quaternion.filter(|at| x[window.start * n + at] < 0.0);
            for (row, z) in z.chunks_exact_mut(width).enumerate() {
                let index = (window.start + row).saturating_sub(self.past).max(first);
                for (slot, value) in sample.iter_mut().zip(&x[index * n..][..n]) {
                    *slot = f64::from(*value);
                }
                if let Some(at) = flip {
                    sample[at..at + 4]
                        .iter_mut()
                        .for_each(|component| *component = -*component);
                }
                self.encoder
                    .encode(&sample, |i, value| z[i] = self.normaliser.input(i, value));
            }
            let wrench = match self.labels {
                Labels::Perturbed => self.split.wrench(window.trajectory),
                Labels::Clean => self.split.clean(window.trajectory),
            };
            let wrench = &wrench[window.start * f..][..samples * f];
            target.extend(
                wrench
                    .iter()
                    .enumerate()
                    .map(|(i, v)| self.normaliser.force(i % f, f64::from(*v))),
            );
        }
        let target = Tensor::from_vec(target, (windows.len(), samples, f), &Device::Cpu)?;
        Ok(Batch {
            z: Tensor::from_vec(z, (windows.len(), rows, width), &Device::Cpu)?,
            start: target.narrow(1, 0, 1)?.squeeze(1)?.contiguous()?,
            target,
        })
    }
}
