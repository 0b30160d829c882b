//! The force from which a trajectory is integrated.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The force from which a trajectory is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InitialForce {
    /// The recorded, perturbed one.
    #[default]
    Recorded,
    /// The clean one.
    Clean,
    /// The model's prediction for a window filled with the first sample.
    Estimate,
    /// Zero force.
    Zero,
}

impl InitialForce {
    /// Every choice, for error messages and help texts.
    pub const ALL: [Self; 4] = [Self::Recorded, Self::Clean, Self::Estimate, Self::Zero];
}

impl fmt::Display for InitialForce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Recorded => "recorded",
            Self::Clean => "clean",
            Self::Estimate => "estimate",
            Self::Zero => "zero",
        })
    }
}

/// An unknown name.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown initial force `{0}`: there are recorded, clean, estimate and zero")]
pub struct UnknownInitialForce(pub String);

impl FromStr for InitialForce {
    type Err = UnknownInitialForce;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|choice| choice.to_string() == name)
            .ok_or_else(|| UnknownInitialForce(name.to_owned()))
    }
}

#[cfg(test)]
#[path = "tests/initial_force.rs"]
mod tests;
