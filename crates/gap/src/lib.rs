//! Finds where simulation and measurement disagree, and which effect is missing.
//!
//! The workflow has four stages and a verdict: [`locate`] (find), [`name`], [`add`], [`verify`], [`conclude`]. Each returns
//! a serde type of [`records`], so that it can be stopped, shown and resumed. "Cannot tell" is a value, not an error.
//!
//! The method is multiple shooting: trials are cut into segments of a few seconds, each predicted open loop from a start
//! that is fitted with it. Outputs are compared, never forces.
//!
//! | folder | holds |
//! |---|---|
//! | `problem` | channels, sensor noise, segments, candidate effects, uncertainty of the nominal |
//! | `rollout` | simulated segments, sensor corrections, whitening, estimated states |
//! | `fit` | sensitivities, Gauss-Newton, Laplace evidence, intervals |
//! | `discrepancy` | AR(1) noise, autocorrelation, error of form, test of adequacy |
//! | `select` | screen, evidence and search over sets of effects |
//! | `likelihood` | marginal likelihood of whole trials, to replace the three above; no stage calls it yet |
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
pub use likelihood::{explain::explain, explanation::Explanation};
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
