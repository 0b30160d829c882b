//! Names of a body's six axes, and parameters for each axis.

use crate::{Parameter, Physical};

/// Along x, y, z, then about them.
pub(crate) const NAMES: [&str; 6] = ["surge", "sway", "heave", "roll", "pitch", "yaw"];

/// Their indices.
pub(super) const SIX: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// Components of a vector.
pub(super) const COMPONENTS: [&str; 3] = ["x", "y", "z"];

/// One parameter for each axis, with a null of zero and never negative; `scale` gives prior standard deviation and upper
/// bound of an axis (0 to 5).
pub(super) fn never_negative(
    units: [&'static str; 2],
    scale: impl Fn(usize) -> (f64, f64),
) -> Vec<Parameter> {
    NAMES
        .into_iter()
        .enumerate()
        .map(|(axis, name)| {
            let (prior_sd, upper) = scale(axis);
            Parameter::about(name, units[axis / 3], 0.0, prior_sd)
                .within(0.0, upper)
                .physically(Physical::NotNegative)
        })
        .collect()
}

/// x, y, z about zero, with a prior standard deviation and a bound for each.
pub(super) fn vector(
    unit: &'static str,
    prior_sd: [f64; 3],
    bound: [f64; 3],
) -> impl Iterator<Item = Parameter> {
    COMPONENTS
        .into_iter()
        .zip(prior_sd.into_iter().zip(bound))
        .map(move |(name, (prior_sd, bound))| {
            Parameter::about(name, unit, 0.0, prior_sd).within(-bound, bound)
        })
}

/// The same with a prefix to the names, all optional.
pub(super) fn optional_vector(
    prefix: &'static str,
    unit: &'static str,
    prior_sd: [f64; 3],
    bound: [f64; 3],
) -> impl Iterator<Item = Parameter> {
    vector(unit, prior_sd, bound).map(move |parameter| Parameter {
        name: format!("{prefix}_{}", parameter.name),
        optional: true,
        ..parameter
    })
}
