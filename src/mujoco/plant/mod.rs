//! A MuJoCo model as `hydro gap` sees it: nuisance parameters to change, effects to add, simulations to step.
//!
//! ```text
//! mujoco_plant  the model, and copies of it with changed parameters
//! description   its bodies, joints and actuators
//! sensors       its sensors
//! nuisances     its uncertain numbers, and how they are changed in a copy
//! model_spec    the model as it is compiled: room for added inertia, backlash
//! backlash      backlash of a joint, as a second joint behind it
//! simulation    one simulation with effects
//! prescribed    imposed motion, and the forces that it takes
//! hidden_joints one with backlash, seen as one of the nominal model
//! passive_hook  MuJoCo's callback in which effects act
//! ```

mod backlash;
mod description;
mod hidden_joints;
mod model_spec;
mod mujoco_plant;
mod nuisances;
mod passive_hook;
mod prescribed;
mod sensors;
mod simulation;

pub use mujoco_plant::MujocoPlant;
