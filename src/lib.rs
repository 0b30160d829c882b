//! hydro: makes water real in MuJoCo.

pub mod features;
pub mod frames;
pub mod model;
