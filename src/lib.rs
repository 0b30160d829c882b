//! hydro: makes water real in MuJoCo.

pub mod comparison;
pub mod features;
pub mod frames;
pub mod robot;
pub mod rollouts;
pub mod sim;
