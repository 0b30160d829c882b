//! The identification problem that every stage starts from: fit trials, their motions, channels, candidate effects.

use crate::{
    options::Options,
    plant::Plant,
    problem::{
        candidates::Candidate,
        channels::{Channels, MeasuredTrial},
        segments::{self, EstimatedMotion, Segment},
        uncertainty::Uncertainty,
    },
};

/// Multiples of it, less their whole parts, are spread evenly and repeat nothing.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Settings of the workflow.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Uncertainty of the nominal.
    pub uncertainty: Uncertainty,
    /// Seed of every draw.
    pub seed: u64,
    /// Statistical choices.
    pub options: Options,
}

/// Trials made ready.
pub struct Problem<'a> {
    pub(crate) plant: &'a dyn Plant,
    pub(crate) trials: Vec<MeasuredTrial>,
    pub(crate) motions: Vec<EstimatedMotion>,
    pub(crate) channels: Channels,
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) settings: Settings,
    /// Largest command of every actuator in the trials.
    pub(crate) commands: Vec<f64>,
    pub(crate) remarks: Vec<String>,
}

impl std::fmt::Debug for Problem<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Problem")
            .field("trials", &self.trials.len())
            .finish_non_exhaustive()
    }
}

impl<'a> Problem<'a> {
    /// Every trial cut into segments of about `length` seconds; of more than `most`, evenly spread ones.
    pub(crate) fn segments(&self, length: f64, most: usize) -> Vec<Segment> {
        let options = &self.settings.options.segments;
        let all: Vec<Segment> = self
            .trials
            .iter()
            .zip(&self.motions)
            .enumerate()
            .flat_map(|(at, (trial, motion))| segments::cut(at, trial, motion, length, options))
            .collect();
        let count = all.len();
        if count <= most {
            return all;
        }
        // Not in step with the trials: always the same part of each would see the same motion.
        let place = |at: usize| (at as f64 + (at as f64 * GOLDEN).fract()) / most as f64;
        (0..most)
            .map(|at| all[((place(at) * count as f64) as usize).min(count - 1)].clone())
            .collect()
    }
}
