//! The search over sets of effects.

pub(crate) mod evidence;
pub(crate) mod linear_evidence;
pub(crate) mod moves;
pub(crate) mod refit;
pub(crate) mod screen;
pub(crate) mod search;
