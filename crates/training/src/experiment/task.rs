//! The paper's two experiments and the names of their data sets.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// One of the paper's two tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Experiment {
    /// Towing: 1.1 one condition, 1.2 changing ones, 1.3 with noise.
    Task1,
    /// Swimming under conditions that keep switching.
    Task2,
}

impl Experiment {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Task1, Self::Task2];

    /// Names of its data sets: Task 1's are folders below the one that is given, Task 2's is that folder itself.
    pub fn data(self) -> &'static [&'static str] {
        match self {
            Self::Task1 => &["1.1", "1.2", "1.3"],
            Self::Task2 => &["2"],
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Task1 => "task1",
            Self::Task2 => "task2",
        })
    }
}

/// An unknown name.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown experiment `{0}`: there are task1 and task2")]
pub struct UnknownExperiment(pub String);

impl FromStr for Experiment {
    type Err = UnknownExperiment;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|experiment| experiment.to_string() == name)
            .ok_or_else(|| UnknownExperiment(name.to_owned()))
    }
}

#[cfg(test)]
#[path = "tests/task.rs"]
mod tests;
