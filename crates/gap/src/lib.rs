//! Find, name, add, verify: where simulation and measurement disagree, and which effect is missing.
//!
//! Each stage is a function from one serde type to the next, so that it can be stopped, shown, resumed
//! and pinned by a test. "Cannot tell" is a value, not an error.
//!
//! Everything rests on one machine, multiple shooting: trials are cut into segments of a few seconds, each
//! predicted open loop from a start that is fitted with it. Outputs are compared,
//! never forces.

mod add;
mod adequacy;
mod bench;
mod candidates;
mod colour;
mod column;
mod conclude;
mod error;
mod experiment;
#[cfg(test)]
mod fake;
mod find;
mod fit;
mod fitted;
mod held_out;
mod information;
mod leftover;
mod measured;
mod name;
mod noise;
mod normal;
pub mod patch;
mod payload;
pub mod plant;
#[cfg(test)]
mod refusals;
mod regime;
mod residual;
mod resolution;
mod screen;
mod search;
mod second_look;
mod shooting;
mod simulated;
pub mod stages;
mod start;
mod study;
mod system;
#[cfg(test)]
mod tests;
pub mod trial;
mod uncertainty;
pub mod verdict;
mod verify;
pub mod wall;
mod watch;

pub use add::{Addition, add};
pub use adequacy::FORM_ERROR;
pub use bench::Bench;
pub use conclude::conclude;
pub use error::GapError;
pub use find::LEVEL;
pub use find::find;
pub use name::{Naming, name};
pub use residual::{MissingWrench, Residual, Series, refitted, residual};
pub use study::{Settings, Study};
pub use uncertainty::Uncertainty;
pub use verify::{Examined, verify};
pub use watch::Watch;
