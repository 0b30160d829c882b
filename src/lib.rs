//! hydro: makes water real in MuJoCo.

pub mod features;
pub mod frames;
#[cfg(feature = "mujoco")]
#[expect(unsafe_code)]
pub mod mujoco;
