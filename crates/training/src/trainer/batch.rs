//! Tensors of a batch of windows.

use candle_core::{Device, Result, Tensor};
use hydro_model::{Encoder, Encoding, Normaliser, features::FeatureLayout};

use super::{config::Labels, windows::Window};
use crate::dataset::Split;

/// z [B, W-1+N, n], F_0 [B, f], labels [B, N, f]; all standardised.
pub(super) struct Batch {
    pub(super) z: Tensor,
    pub(super) start: Tensor,
    pub(super) target: Tensor,
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

/// Turns windows into tensors.
#[derive(Clone, Debug)]
pub(super) struct Batcher<'a> {
    pub(super) split: &'a Split,
    pub(super) encoder: &'a Encoder,
    pub(super) normaliser: &'a Normaliser,
    /// Column of the quaternion, if its sign reaches the network.
    pub(super) quaternion: Option<usize>,
    /// W - 1, samples of the past in front of a window.
    pub(super) past: usize,
    pub(super) labels: Labels,
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

/// Column of the quaternion, if the encoding keeps its sign, which is made positive at the start of a window.
pub(super) fn signed_quaternion(encoding: &Encoding, layout: &FeatureLayout) -> Option<usize> {
    layout
        .quaternion()
        .filter(|_| !encoding.replaces_quaternion())
}
