//! The plugin without MuJoCo: text attributes in, wrench out.
//!
//! ```text
//! attributes      strings -> Settings (attribute_error)  attribute_table  what each is
//! search_path     where a relative path is looked for
//! body            what a model offers a card     feature_map  state of the model -> input of the network
//! learned_wrench  a checkpoint's wrench on a body, from a slice of state
//! bound           named effects, tied to a model
//! instance        one `hydro.wrench`: a checkpoint and effects together
//! registry        loaded checkpoints and instances, shared by the process; handle: a thread's own
//! sea             surface, waves and current around an instance
//! native_fluid    MuJoCo's own fluid, a body at a time (for load cells)
//! ```
//!
//! Nothing here names a type of MuJoCo's; `src/mujoco/` reads its structs and calls in.

pub mod attribute_error;
pub mod attribute_table;
pub mod attributes;
pub mod body;
pub mod bound;
pub mod feature_map;
pub mod handle;
pub mod instance;
pub mod learned_wrench;
pub mod native_fluid;
pub mod registry;
pub mod sea;
pub mod search_path;

pub use attribute_error::AttributeError;
pub use attributes::{InitialForce, Settings};
pub use body::{Base, Body, BodyError, Joint, JointKind};
pub use bound::{Afloat, BodyHull, Bound};
pub use feature_map::FeatureMap;
pub use handle::Handle;
pub use instance::Instance;
pub use learned_wrench::{LearnedForce, LearnedWrench, Moment, Notice};
pub use registry::{InstanceKey, Registry, SetupError};
