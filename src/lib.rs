//! hydro: makes water real in MuJoCo.

pub mod checkpoint;
pub mod features;
pub mod frames;
pub mod model;
#[cfg(feature = "mujoco")]
#[expect(unsafe_code)]
pub mod mujoco;
pub mod plugin;
