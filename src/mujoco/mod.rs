//! The only room with `unsafe` code: everything that touches MuJoCo's memory or is called by MuJoCo.
//!
//! ```text
//! bindings          structs and table of functions, from build.rs       api       which MuJoCo to call
//! views             pointers and counts as slices                       boundary  no panic leaves Rust
//! describe, apply   model -> plugin::Body; wrench -> joint space        warn      MuJoCo's own channel
//! wrench, load_cell the engine plugins (MuJoCo with engine plugins)     load      runs at library load
//! passive_callback  the same force in Debian's 2.2.2
//! bind              named effects -> numbers of a model          scale, walls  sizes; what is around
//! effect_forces     where effects act, for plugin and plant      water, native, actuation  its parts
//! plant, nuisance parameters, readings, spec, run   a nominal model as `hydro gap` sees it
//! simulator         owned models and simulations, for `hydro` and tests
//! scene, swimmer    a scene's plugin attributes; a robot in it, as comparisons see it
//! ```

#[cfg(mujoco_plugins)]
mod actuation;
mod api;
mod apply;
#[cfg(mujoco_plugins)]
mod arrows;
#[cfg(mujoco_plugins)]
mod bind;
mod bindings;
mod boundary;
mod describe;
#[cfg(mujoco_plugins)]
mod effect_forces;
mod load;
#[cfg(mujoco_plugins)]
mod load_cell;
#[cfg(mujoco_plugins)]
mod native;
#[cfg(mujoco_plugins)]
mod nuisances;
#[cfg(not(mujoco_plugins))]
mod passive_callback;
#[cfg(mujoco_plugins)]
pub mod plant;
#[cfg(mujoco_plugins)]
mod readings;
#[cfg(mujoco_plugins)]
mod run;
#[cfg(mujoco_plugins)]
mod scale;
pub mod scene;
pub mod simulator;
#[cfg(mujoco_plugins)]
mod spec;
#[cfg(mujoco_plugins)]
pub mod swimmer;
mod views;
#[cfg(mujoco_plugins)]
mod walls;
mod warn;
pub mod warnings;
#[cfg(mujoco_plugins)]
mod water;
#[cfg(mujoco_plugins)]
mod wrench;

pub use api::{ApiError, INCLUDE, LIBRARY, VERSION};
pub use load::register;
