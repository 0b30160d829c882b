//! Progress of a training run, and the observer that receives it.

use super::log::LogRecord;
use crate::metrics::Evaluation;

/// Progress of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainProgress {
    /// Epoch, from 0.
    pub epoch: usize,
    /// Largest number of them.
    pub epochs: usize,
    /// Steps done over all epochs.
    pub step: usize,
    /// Largest number of them.
    pub steps: usize,
    /// Mean loss of the epoch so far (squared standard deviations).
    pub loss: f64,
    /// Learning rate of the last step.
    pub learning_rate: f64,
    /// Best validation error so far.
    pub best: Option<f64>,
    /// Time to the last epoch at the present pace [s].
    pub remaining_secs: f64,
}

/// Listener to a run.
pub trait Observer {
    /// After every step.
    fn step(&mut self, progress: &TrainProgress) {
        let _ = progress;
    }

    /// After every epoch, with its validation; none where that split is empty.
    fn epoch(&mut self, record: &LogRecord, validation: Option<&Evaluation>) {
        let _ = (record, validation);
    }
}

/// Ignores all.
impl Observer for () {}
