//! Simulated segments, sensor corrections, whitening, and estimated states along a trial.

pub(crate) mod prepare;
pub(crate) mod resolution;
pub(crate) mod sensor_correction;
pub(crate) mod shooting;
pub(crate) mod state_estimation;
pub(crate) mod system;
pub(crate) mod whitening;
