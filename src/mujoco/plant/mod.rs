//! A MuJoCo model as `hydro gap` sees it: nuisance parameters to change, effects to add, simulations to step.
//!
//! ```text
//! nominal       the model, and copies of it with changed parameters
//! description   its bodies, joints and actuators
//! sensors       its sensors
//! nuisances     its uncertain numbers, and how they are changed in a copy
//! model_edits   changes before compiling: room for added inertia, backlash in joints
//! simulation    one simulation with effects
//! backlash      one with backlash, seen as one of the nominal model
//! passive_hook  MuJoCo's callback in which effects act
//! ```

mod backlash;
mod description;
mod model_edits;
mod nominal;
mod nuisances;
mod passive_hook;
mod sensors;
mod simulation;

pub use nominal::MujocoPlant;
