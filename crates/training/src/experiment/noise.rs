//! Sensors that are wrong: noise on what a model is told.

use hydro_model::features::FeatureLayout;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::detail::deviations;
use crate::dataset::Split;

/// Standard deviations of the noise, as shares of each feature's own; beside them there is none.
pub(super) const LEVELS: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

/// Numbers that noise is drawn from; everybody has the same noise.
const SEED: u64 = 20;

/// The split with white Gaussian noise of `level` standard deviations on every feature but the density, which is set and not
/// measured. A quaternion is one again afterwards.
pub(super) fn noisy(split: &Split, layout: &FeatureLayout, level: f64) -> Split {
    let std = deviations(split.inputs(), (0..split.len()).map(|index| split.x(index)));
    let mut scale: Vec<f64> = std.into_iter().map(|std| level * std).collect();
    if let Some(density) = layout.density() {
        scale[density] = 0.0;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut split = split.clone();
    split.edit_samples(|x| {
        for (value, scale) in x.iter_mut().zip(&scale) {
            *value += (scale * normal(&mut rng)) as f32;
        }
        if let Some(at) = layout.quaternion() {
            let quaternion = &mut x[at..at + 4];
            let norm = quaternion.iter().map(|q| q * q).sum::<f32>().sqrt();
            quaternion.iter_mut().for_each(|q| *q /= norm);
        }
    });
    split
}

/// A standard normal number (Box and Muller).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
