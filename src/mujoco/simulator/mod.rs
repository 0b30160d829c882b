//! Owned models and simulations: what `hydro simulate` and the tests step.
//!
//! A [`Model`] is compiled once and shared; each [`Data`] is one simulation of it. Names are looked up
//! once, into plain numbers and ranges of the slices that [`Data`] gives.

mod data;
mod error;
mod model;
#[cfg(mujoco_plugins)]
mod swimmer;

#[cfg(mujoco_plugins)]
pub(super) use self::error::{ERROR_LEN, c_path, refused};
pub use self::{
    data::Data,
    error::SimulatorError,
    model::{BodyInertia, Integrator, JointGeometry, Model},
};
#[cfg(mujoco_plugins)]
pub use self::{model::BodyShape, swimmer::Swimmer};
