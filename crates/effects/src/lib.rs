//! Catalogue of physical effects that a robot's simulation may lack: drag, added mass, currents, waves, payloads,
//! friction, backlash, delays, biases.
//!
//! An effect is written once: `hydro gap` fits the same code that the plugin `hydro.wrench` applies. SI units; a wrench
//! is force [N] and torque [N m] about the body's origin, in the body's frame.
//!
//! - [`catalogue`]: one effect a file; [`effect`] finds one by its [`Id`], [`all`] lists them.
//! - [`Effect`]: the trait. Its [`Part`] acts on a body, the water, a joint, an actuator or a sensor.
//! - [`card`]: name, equation and source of an effect, and its parameters with units, priors and bounds on a [`Target`].
//! - [`Motion`]: motion of a body through the water, the argument of every wrench.
//! - [`sea`]: waves and currents as a field in place and time.
//! - [`hydrostatics`]: volume and centre of the part of a hull below a surface.
//! - [`own`]: the user's own effects, written as expressions in a file.
//! - [`fossen`]: tables of hydrodynamic derivatives (X_udot, Y_v, N_r|r|) turned into effects.
//! - [`EffectSet`]: effects with values on the parts of one model, read from and written to `effects.json`.
//!
//! It knows no simulator: who applies the effects fills in [`Motion`] and implements [`Targets`].
//!
//! ```
//! use hydro_effects::{BodyPart, Motion, catalogue::quadratic_drag::QuadraticDrag};
//!
//! let motion = Motion {
//!     linear: [0.5, 0.0, 0.0],
//!     density: 1000.0,
//!     ..Motion::default()
//! };
//! let surge_to_yaw = [18.0, 40.0, 40.0, 0.1, 0.5, 0.5];
//! let wrench = QuadraticDrag.wrench(&surge_to_yaw, &motion, &[]);
//! assert_eq!(wrench[0], -18.0 * 0.5 * 0.5);
//! ```
//!
//! A new effect is a file of [`catalogue`], a name in [`Id`] and a line in [`effect`]; the tests of this crate then hold
//! it to what every effect must do.

pub mod card;
pub mod catalogue;
pub mod did_you_mean;
mod dual;
mod effect;
mod flow;
pub mod fossen;
pub mod from_hull;
pub mod hydrostatics;
mod json_shape;
mod matrix_fault;
mod matrix_json;
mod motion;
pub mod own;
pub mod potential_flow;
pub mod sea;
mod set;
mod set_error;
#[cfg(test)]
mod tests;
mod wrench_law;

pub use card::{Card, Id, Medium, Parameter, Physical, Placement, Target, TargetKind};
pub use catalogue::{all, effect};
pub use effect::{
    ActuatorPart, BodyPart, Effect, Entry, JointMotion, JointPart, MATRIX_AT_POINT_LEN, MATRIX_LEN,
    MatrixPart, NearBoundary, Part, SensorPart, WaterPart, is_matrix,
};
pub use matrix_fault::MatrixFault;
pub use motion::Motion;
pub use own::OwnError;
pub use set::{EffectSet, Targets, listed_id};
pub use set_error::{SCHEMA, SetError};
