//! Trials: what is read, what is said of it, what is refused, and the exchange with `mujoco.sysid`.
#![allow(missing_docs, clippy::unwrap_used)]

mod csv;
mod exchange;
mod files;
mod fixture;
mod npz;
mod random;
