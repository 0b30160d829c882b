//! Reasons for training or evaluation to stop.

use std::{io, path::PathBuf};

use hydro_model::{ModelError, checkpoint::CheckpointError};
use thiserror::Error;

use crate::{dataset::DatasetError, trainer::DeviceError};

/// Why training or evaluation stopped.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TrainError {
    /// A finished checkpoint that is not the one asked for.
    #[error("the finished checkpoint has another {what}: {found}; asked for: {expected}")]
    OtherCheckpoint {
        /// The property that differs.
        what: &'static str,
        /// The checkpoint's.
        found: String,
        /// The value asked for.
        expected: String,
    },
    /// A setting out of its range.
    #[error("{field} is {found}, expected {expected}")]
    Config {
        /// Which setting.
        field: &'static str,
        /// Its value.
        found: String,
        /// The allowed values.
        expected: String,
    },
    /// The loss is no longer a number.
    #[error(
        "the loss is {loss} at epoch {epoch}, step {step}: lower the learning rate (now {learning_rate}) or the horizon"
    )]
    Diverged {
        /// Epoch, from 0.
        epoch: usize,
        /// Step over all epochs.
        step: usize,
        /// The loss.
        loss: f64,
        /// Learning rate of that step.
        learning_rate: f64,
    },
    /// Error of the device.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A split is empty or of the wrong shape for the model.
    #[error("the {split} split {reason}")]
    Split {
        /// Its name.
        split: &'static str,
        /// The fault.
        reason: String,
    },
    /// A state file that is not this run's.
    #[error("{}: {reason}; remove it or start in another folder", path.display())]
    State {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// Error of the data set.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Error of the checkpoint.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Error of the model.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl From<candle_core::Error> for TrainError {
    fn from(error: candle_core::Error) -> Self {
        Self::Model(error.into())
    }
}
