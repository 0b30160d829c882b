//! Length of a training, the same for every model.

use serde::{Deserialize, Serialize};

/// Length of training, the same for every model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Passes over the training split; nobody stops earlier.
    pub epochs: usize,
    /// Training trajectories; all without a number.
    pub trajectories: Option<usize>,
    /// Windows a step.
    pub batch: usize,
    /// Samples a window.
    pub horizon: usize,
}

impl Budget {
    /// The budget of the tables, by the name of the data set: about a thousand steps on Task 2, four hundred on each set of Task 1.
    pub fn full(data: &str) -> Self {
        Self {
            epochs: match data {
                // 154 trajectories of one or two windows; 1600 of one; 800 of eight.
                "1.1" => 48,
                "1.2" | "1.3" => 8,
                _ => 6,
            },
            trajectories: None,
            batch: 32,
            horizon: 50,
        }
    }

    /// A look: little of the data, some thirty steps.
    pub fn quick(data: &str) -> Self {
        Self {
            epochs: match data {
                "1.1" | "1.2" | "1.3" => 12,
                _ => 2,
            },
            trajectories: Some(64),
            ..Self::full(data)
        }
    }
}
