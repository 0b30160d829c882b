//! hydro: water for MuJoCo.
//!
//! This crate holds what touches MuJoCo or a person: the plugin `libhydro_plugin.so`, the simulator behind `hydro simulate`
//! and `hydro gap`, and the reports. The rest is in crates that know neither:
//!
//! | crate | content |
//! |---|---|
//! | [`frames`] | units, frames, wrenches, twists |
//! | [`effects`] | the catalogue of physical effects: one effect a file, one trait |
//! | [`gap`] | trials, patches of an MJCF, and the workflow find, name, add, verify |
//! | [`model`] | features, architectures, engines, checkpoints |
//! | [`training`] | data sets, trainer, metrics, comparison with baselines, the paper's experiments |
//!
//! ```
//! use hydro_plugin::effects::{all, effect, Id};
//!
//! assert!(all().count() > 20);
//! println!("{}", effect(Id::QuadraticDrag).card().equation);
//! ```

pub use hydro_effects as effects;
pub use hydro_frames as frames;
pub use hydro_gap as gap;
pub use hydro_model as model;
pub use hydro_training as training;

#[cfg(feature = "mujoco")]
#[expect(unsafe_code)]
pub mod mujoco;
pub mod plugin;
pub mod report;
