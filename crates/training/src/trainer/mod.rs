//! The training loop: windows of trajectories, the loss, the optimiser and its schedule, state on disk.
//!
//! A run can be stopped anywhere and resumed to the bit. Nothing here prints: an [`Observer`] is told.

mod adamw;
mod batch;
mod config;
mod device;
mod log;
mod normaliser;
mod observer;
mod range;
mod run;
mod schedule;
mod state;
mod windows;

pub use self::{
    adamw::{AdamW, StepSettings},
    config::{Labels, TrainConfig},
    device::{DeviceError, TrainDevice, UnknownDevice},
    log::LogRecord,
    observer::{Observer, TrainProgress},
    run::{TrainOutcome, Trainer},
};
