//! Bodies of a compiled model, in the terms of the plugin: how they are held, where they are, what MuJoCo's fluid
//! does to them.
//!
//! ```text
//! base_body    the body that carries the plugin, and the model's joints, as a checkpoint's card sees them
//! joint_space  points and rotations of MuJoCo's; a wrench on a body as generalised forces
//! hull         which geoms are the robot's hull, and how much of it is under water
//! fluid_loads  MuJoCo's own fluid, a body at a time
//! ```

pub(crate) mod base_body;
#[cfg(mujoco_plugins)]
pub(crate) mod fluid_loads;
pub(crate) mod hull;
pub(crate) mod joint_space;
