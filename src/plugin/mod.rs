//! The plugin's own thinking, without MuJoCo: text attributes in, wrench out.
//!
//! ```text
//! attributes  strings -> Settings            search   where a relative path is looked for
//! body        what a model offers a card     features state of the model -> input of the network
//! instance    state slice in, wrench out     cold_start  the first sample of a run
//! bound       named effects, tied to a model; carrier: a checkpoint and effects together
//! registry    loaded checkpoints, shared     waterline   how much of the robot is under water
//! native_fluid  MuJoCo's own fluid, a body at a time (for load cells)
//! ```
//!
//! Nothing here names a type of MuJoCo's; `src/mujoco/` reads its structs and calls in.

pub mod attributes;
pub mod body;
pub mod bound;
pub mod carrier;
mod cold_start;
pub mod features;
pub mod handle;
pub mod instance;
pub mod native_fluid;
pub mod registry;
pub mod search;
pub mod waterline;

pub use attributes::{AttributeError, InitialForce, Settings};
pub use body::{Base, Body, BodyError, Joint, JointKind};
pub use bound::Bound;
pub use carrier::Carrier;
pub use features::FeatureMap;
pub use handle::Handle;
pub use instance::{Instance, Moment, Notice};
pub use registry::{InstanceKey, Registry, SetupError};
