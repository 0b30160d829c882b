//! Finds where simulation and measurement disagree, and which effect is missing.
//!
//! The workflow has four stages and a verdict: [`locate`] (find) where the nominal fails that [`Followed`] the trials, [`name`]
//! what [`explain`]s them, [`add`], [`verify`], [`conclude`]. Each returns a serde type of [`records`], so that it can be
//! stopped, shown and resumed. "Cannot tell" is a value, not an error.
//!
//! Trials are cut into short segments, each shot from a start that follows the readings. Outputs are compared, never forces:
//! one marginal likelihood judges every set of effects, starts and unmodelled forces integrated out.
//!
//! | folder | holds |
//! |---|---|
//! | `problem` | channels, sensor noise, candidate effects, uncertainty of the nominal |
//! | `rollout` | simulated segments, sensor corrections, whitening, estimated states |
//! | `likelihood` | marginal likelihood of whole trials, search over sets of effects, their posterior |
//! | `stage` | the stages |
//! | `residual` | the wrench that no effect explains |
//! | `output` | [`records`] and [`verdict`] |
//! | [`trial`], [`plant`], [`patch`] | logs, the simulator, the patched model |
//!
//! [`Options`] holds every statistical choice. An uncertainty file is read so:
//!
//! ```
//! use hydro_gap::Uncertainty;
//!
//! let uncertainty = Uncertainty::parse("mass = 0.1", &[])?;
//! assert_eq!(uncertainty.mass, 0.1);
//! # Ok::<(), hydro_gap::GapError>(())
//! ```

mod error;
mod likelihood;
pub mod options;
mod output;
pub mod patch;
pub mod plant;
mod problem;
mod progress;
mod residual;
mod rollout;
mod stage;
mod statistics;
#[cfg(test)]
mod tests;
pub mod trial;

pub use error::GapError;
pub use likelihood::{explain::explain, explanation::Explanation, followed::Followed};
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
    cross_fit::is_cross_fitted,
    locate::locate,
    name::{Naming, name},
    verify::{VerifyInput, verify},
};
