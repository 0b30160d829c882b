//! From a data set to a checkpoint: windows, loss, optimiser, schedule, a trainer that can be stopped and
//! resumed to the bit, and the errors of a finished model.
//!
//! The loss is the mean squared error of the force, in standard deviations, over every sample of a window that is
//! integrated from the recorded force at its start; the gradient runs through the solver ([`hydro_model`]).
//! Nothing here prints: an [`Observer`] is told.

mod adamw;
pub mod comparison;
mod config;
pub mod dataset;
mod device;
pub mod drag;
mod envelope;
pub mod experiment;
mod log;
mod metrics;
mod residual;
pub mod rollouts;
mod schedule;
pub mod simulator;
mod state;
mod trainer;
mod windows;

use std::{io, path::PathBuf};

use hydro_model::{ModelError, checkpoint::CheckpointError};
use thiserror::Error;

pub use self::{
    adamw::{AdamW, Step},
    config::{Labels, TrainConfig},
    device::{TrainDevice, UnknownDevice},
    log::LogRecord,
    metrics::{
        Errors, Evaluation, InitialForce, Sums, UnknownInitialForce, evaluate, predict,
        predict_split,
    },
    residual::{Learned, Lesson, Recorded, learn_residual},
    trainer::{Observer, Outcome, Progress, Trainer},
};
use crate::dataset::DatasetError;

/// Why training or evaluation stopped.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TrainError {
    /// A finished checkpoint that is not the one asked for.
    #[error("the finished checkpoint has another {what}: {found}; asked for: {expected}")]
    OtherCheckpoint {
        /// What differs.
        what: &'static str,
        /// The checkpoint's.
        found: String,
        /// What was asked for.
        expected: String,
    },
    /// A setting out of its range.
    #[error("{field} is {found}, expected {expected}")]
    Config {
        /// Which setting.
        field: &'static str,
        /// Its value.
        found: String,
        /// What it may be.
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
    /// A graphics card asked of a build that has no CUDA.
    #[error(
        "{device}: this build has no CUDA; `cargo build --release --features cuda --target-dir target/cuda` makes one that does"
    )]
    WithoutCuda {
        /// What was asked for.
        device: TrainDevice,
    },
    /// A graphics card that cannot be used.
    #[error("{device} cannot be used: {reason}; `--device cpu` needs no graphics card")]
    NoDevice {
        /// What was asked for.
        device: TrainDevice,
        /// What the driver said.
        reason: String,
    },
    /// A split is empty or of the wrong shape for the model.
    #[error("the {split} split {reason}")]
    Split {
        /// Its name.
        split: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A state file that is not this run's.
    #[error("{}: {reason}; remove it or start in another folder", path.display())]
    State {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// From the data set.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// From the checkpoint.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// From the model.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl From<candle_core::Error> for TrainError {
    fn from(error: candle_core::Error) -> Self {
        Self::Model(error.into())
    }
}
