//! The plugin as a simulation meets it: in MuJoCo's step, in Python, as a passive callback, on recorded rollouts.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stderr)]

#[path = "../common/mod.rs"]
mod common;
mod fish;
mod joints;
mod native_fluid;
mod python;
mod reference;
mod robot;
mod rollouts;
#[cfg(mujoco_plugins)]
#[path = "../common/skip_python.rs"]
mod skip_python;
mod whole_matrix;
