//! Marginal likelihood of the trials under a model linearised along the measured motion.
//!
//! A trial is cut into short segments, each shot from a start that follows the readings. Along every segment one pass gives
//! the first-order changes of all readings and of its end with its start, with forces that nobody modelled, with the
//! uncertain numbers of the nominal and with every candidate effect. A Kalman filter over the segments integrates starts
//! and unmodelled forces out, so that one Gram matrix of what is left holds the likelihood of every set of effects.
//!
//! Sources: P. de Jong, The diffuse Kalman filter, Ann. Statist. 19 (1991), for regressors carried through the filter;
//! M. C. Kennedy and A. O'Hagan, Bayesian calibration of computer models, J. R. Stat. Soc. B 63 (2001), for the discrepancy.

pub(crate) mod by_trial;
mod carry;
pub(crate) mod changes;
mod choices;
pub(crate) mod coloured_noise;
pub(crate) mod columns;
mod command_forces;
pub(crate) mod differing;
pub(crate) mod directions;
pub(crate) mod disturbances;
pub(crate) mod edge;
mod every_step;
pub(crate) mod explain;
pub(crate) mod explanation;
pub(crate) mod felt_forces;
pub(crate) mod filter;
pub(crate) mod followed;
pub(crate) mod force_scale;
pub(crate) mod form_error;
pub(crate) mod found;
pub(crate) mod given;
mod held;
pub(crate) mod innovations;
mod layout;
pub(crate) mod level;
pub(crate) mod levels;
mod likelier_commands;
pub(crate) mod memories;
pub(crate) mod neglected_terms;
mod promised;
pub(crate) mod quadratic;
pub(crate) mod refits;
mod reversals;
pub(crate) mod scale_slope;
mod search;
pub(crate) mod seen;
pub(crate) mod set_prior;
mod settle;
pub(crate) mod slow_drift;
mod starts;
pub(crate) mod step_changes;
mod symmetric;
pub(crate) mod track;
pub(crate) mod truncated_evidence;
pub(crate) mod truncated_normal;
pub(crate) mod working_point;
