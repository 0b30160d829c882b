//! Units, frames and six-vectors shared by every crate of hydro.
//!
//! SI units; angles in radians. The **world** frame is MuJoCo's, z up. The **base** frame is that of the body with the
//! plugin (B1: `trunk`). A rotation is named for its action: `world_from_base` takes a vector expressed in the base frame
//! to the world frame.
//!
//! - [`Wrench`], [`Twist`]: force and torque, and angular and linear velocity, of the base.
//! - [`world_from_base`], [`base_from_world`], [`to_world`], [`continuous_quaternion`]: rotations from MuJoCo's `w x y z`.
//! - [`output_units_fault`], [`frames_fault`]: checks of the units and frames that a file declares.
//!
//! ```
//! use hydro_frames::to_world;
//!
//! // A quarter turn about z takes the base's x to the world's y.
//! let half = std::f64::consts::FRAC_1_SQRT_2;
//! let in_world = to_world([half, 0.0, 0.0, half], [1.0, 0.0, 0.0]);
//! assert!((in_world[1] - 1.0).abs() < 1e-12);
//! ```

mod declarations;
mod rotation;
mod six_vectors;

pub use declarations::{frames_fault, output_units_fault};
pub use rotation::{base_from_world, continuous_quaternion, to_world, world_from_base};
pub use six_vectors::{Twist, Wrench};

/// Acceleration of gravity used where a model does not say its own [m/s^2].
pub const STANDARD_GRAVITY: f64 = 9.81;
