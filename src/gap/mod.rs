//! Find, name, add, verify: where simulation and measurement disagree, and which effect is missing.
//!
//! Each stage is a function from one serde type to the next, so that it can be stopped, shown, resumed
//! and pinned by a test. "Cannot tell" is a value, not an error.
//!
//! Everything rests on one machine, [`shooting`]: trials are cut into segments of a few seconds, each
//! predicted open loop from a start that is fitted with it (multiple shooting). Outputs are compared,
//! never forces.

pub mod stages;
pub mod verdict;
