//! `hydro.wrench`: the force of the water on a body, as an engine plugin.
//!
//! ```text
//! plugin            registration and MuJoCo's callbacks
//! instances         the plugin's instances in a model: set up, found again, their bodies
//! instance_effects  the named effects of all instances, added to MuJoCo's forces
//! applied           the wrench of an instance at a state
//! submerged         how much of a body is under water, for callers outside MuJoCo
//! origins           the attributes that an instance was made from, held against those of a model
//! memory_fit        an instance's memory held against what its model was compiled for
//! told_once         warnings that are given once in a process
//! warned_once       simulations that were warned already
//! arrows            what a viewer draws
//! passive_callback  the same force in Debian's MuJoCo 2.2.2, which has no engine plugins
//! ```

#[cfg(mujoco_plugins)]
pub(crate) mod applied;
#[cfg(mujoco_plugins)]
mod arrows;
#[cfg(mujoco_plugins)]
pub(crate) mod instance_effects;
#[cfg(mujoco_plugins)]
pub(crate) mod instances;
#[cfg(mujoco_plugins)]
mod memory_fit;
#[cfg(mujoco_plugins)]
mod origins;
#[cfg(not(mujoco_plugins))]
pub(crate) mod passive_callback;
#[cfg(mujoco_plugins)]
pub(crate) mod plugin;
#[cfg(mujoco_plugins)]
pub(crate) mod submerged;
mod told_once;
#[cfg(mujoco_plugins)]
mod warned_once;
