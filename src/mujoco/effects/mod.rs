//! Named effects in a simulation, for the plugin and for `hydro gap` alike.
//!
//! ```text
//! bind            effects of a file, by the names of their targets, tied to a model's numbers
//! surroundings    the water around them, as the attributes give it
//! wet_bodies      bodies that effects act on, and their hulls
//! sizes           sizes of bodies, joints and actuators: the scales of an effect's parameters
//! active_effects  what a simulation of `hydro gap` adds to its model
//! source          effects with their memory, of one instance or one simulation
//! water, walls    how the water moves at a point; the nearest wall
//! submersion      how much of a body is under water, and the pressure on its hull
//! frame           a body's frame, and how its degrees of freedom move it
//! body_load       wrench, inertia and damping of the effects on one body
//! potential_flow  waves that a hull makes and meets, by a boundary element program
//! actuation       actuators that do not do what they are told
//! forces          the sum, into MuJoCo's passive forces and inertia matrix
//! ```

pub(crate) mod active_effects;
pub(crate) mod actuation;
pub(crate) mod bind;
mod body_load;
pub(crate) mod forces;
mod frame;
mod potential_flow;
pub(crate) mod sizes;
pub(crate) mod source;
pub(crate) mod submersion;
pub(crate) mod surroundings;
pub(crate) mod walls;
mod water;
pub(crate) mod wet_bodies;
