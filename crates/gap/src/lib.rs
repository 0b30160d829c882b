//! Find, name, add, verify: where simulation and measurement disagree, and which effect is missing.
//!
//! Each stage is a function from one serde type to the next, so that it can be stopped, shown, resumed
//! and pinned by a test. "Cannot tell" is a value, not an error.
//!
//! Everything rests on one machine, multiple shooting: trials are cut into segments of a few seconds, each
//! predicted open loop from a start that is fitted with it. Outputs are compared,
//! never forces.

mod discrepancy;
mod error;
mod fit;
pub mod options;
mod output;
pub mod patch;
pub mod plant;
mod problem;
mod progress;
mod residual;
mod rollout;
mod select;
mod stage;
mod statistics;
#[cfg(test)]
mod tests;
pub mod trial;

pub use error::GapError;
pub use fit::linearized_problem::LinearizedProblem;
pub use options::Options;
pub use output::{records, verdict};
pub use problem::{
    problem::{Problem, Settings},
    uncertainty::Uncertainty,
};
pub use progress::Watch;
pub use residual::{MissingWrench, Residual, WrenchSeries, residual};
pub use stage::{
    add::{Addition, add, refitted},
    conclude::conclude,
    locate::locate,
    name::{Naming, name},
    verify::{VerifyInput, verify},
};
