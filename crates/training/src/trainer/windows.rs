//! Windows of the training trajectories, cut anew every epoch.

use rand::{RngExt as _, SeedableRng as _, seq::SliceRandom as _};
use rand_chacha::ChaCha8Rng;

use super::config::TrainConfig;
use crate::dataset::Split;

/// A window of a trajectory.
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
pub(super) fn cut_windows(config: &TrainConfig, split: &Split, epoch: usize) -> Vec<Window> {
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

/// Steps of every epoch: the least number that any cut gives.
pub(super) fn steps_per_epoch(config: &TrainConfig, split: &Split) -> usize {
    let steps = config.horizon.min(split.samples()) - 1;
    let last_start = (split.samples() - 1) - steps;
    let least = 1 + (last_start - last_start.min(steps - 1)) / steps;
    (split.len() * least).div_ceil(config.batch)
}
