//! hydro: makes water real in MuJoCo.

#[cfg(feature = "mujoco")]
#[expect(unsafe_code)]
pub mod mujoco;
pub mod plugin;
pub mod report;
