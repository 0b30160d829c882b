//! The user's own effects: a file `NAME.toml` says target, parameters and expressions; it is checked, compiled to a small
//! program, and is then an effect like any other under the name `user.NAME`.
//!
//! ```toml
//! summary = "a spring that holds the hull"
//! target = "body"
//!
//! [parameters.stiffness]
//! unit = "N/m"
//! lower = 0.0
//! upper = 100.0
//! prior_sd = 10.0
//!
//! [world_force]
//! x = "-stiffness * x"
//! ```
//!
//! ```text
//! source       the file
//! units        units, and what becomes of them in arithmetic
//! expression   text to syntax tree
//! check        unit and bounds of an expression
//! quantities   what the expressions of a target may name
//! declared     names and parameters of a file
//! texts        expressions of a file, units and bounds of all
//! definition   a checked file, its programs
//! bytecode     programs
//! effect       a definition as an effect
//! registry     all definitions of this process
//! ```
//!
//! What passes the check is finite for all inputs within their bounds, and inputs are held within them; a value that is not
//! finite all the same (a memory that was set to NaN) counts as no force, and the caller says so.

mod bytecode;
mod check;
mod declared;
mod definition;
mod effect;
mod error;
mod expression;
mod quantities;
pub(crate) mod registry;
mod source;
#[cfg(test)]
mod tests;
mod texts;
mod units;

pub use error::OwnError;
pub use registry::{register_json, register_toml};
pub use source::LARGEST_FILE;
