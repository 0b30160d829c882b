//! MuJoCo, and the only code of the crate that is `unsafe`: everything that touches MuJoCo's memory or is called by
//! MuJoCo.
//!
//! ```text
//! ffi           MuJoCo's structs and functions, as slices; panics, warnings and refusals
//! bodies        how a body is held and moves; wrench -> joint space; hull; MuJoCo's own fluid
//! effects       named effects, tied to a model and added to its forces
//! wrench        the engine plugin hydro.wrench
//! load_cell     the engine plugin hydro.load_cell
//! registration  makes both known to MuJoCo: at load of the library, or asked for by a program
//! simulator     owned models and simulations, for `hydro` and tests
//! plant         a nominal model as `hydro gap` sees it
//! scene         plugin attributes in an MJCF text, set before the model is compiled
//! ```
//!
//! Each names only those above it, and `plant` the simulator. A MuJoCo without engine plugins (2.2.2) has `ffi`,
//! `bodies`, `simulator` and `wrench/passive_callback` alone.

mod bodies;
#[cfg(mujoco_plugins)]
mod effects;
mod ffi;
#[cfg(mujoco_plugins)]
mod load_cell;
#[cfg(mujoco_plugins)]
pub mod plant;
mod registration;
pub mod scene;
pub mod simulator;
mod wrench;

pub use ffi::{
    api::{ApiError, INCLUDE, VERSION, accepted, library, python_package},
    warnings,
};
pub use registration::register;
