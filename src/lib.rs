//! hydro: makes water real in MuJoCo.

pub mod checkpoint;
pub mod comparison;
pub mod dataset;
mod document;
pub mod drag;
pub mod effects;
pub mod envelope;
pub mod experiment;
pub mod features;
pub mod frames;
pub mod gap;
pub mod kinematics;
pub mod model;
#[cfg(feature = "mujoco")]
#[expect(unsafe_code)]
pub mod mujoco;
pub mod patch;
pub mod plugin;
pub mod report;
pub mod robot;
pub mod rollouts;
pub mod sim;
pub mod training;
pub mod trial;
