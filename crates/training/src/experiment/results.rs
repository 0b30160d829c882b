//! Results of a whole experiment.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    budget::Budget,
    ordering::Ordering,
    table::{Reference, Row},
    task::Experiment,
};

/// The whole of an experiment.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ExperimentResults {
    /// Which one.
    pub experiment: Experiment,
    /// The command that made it.
    pub command: String,
    /// Training budget by data set.
    pub budgets: BTreeMap<String, Budget>,
    /// Data sets by name: sha256 of the manifest.
    pub data: BTreeMap<String, String>,
    /// Names of the force components.
    pub outputs: Vec<String>,
    /// Rows, data set after data set.
    pub rows: Vec<Row>,
    /// Rows without learning and the paper's own, data set after data set.
    #[serde(default)]
    pub yardsticks: Vec<Row>,
    /// Reference methods in closed loop: baselines, and the true wrench.
    pub references: Vec<Reference>,
    /// Claims, the paper's and ours.
    pub orderings: Vec<Ordering>,
    /// True force along the first test trajectory, by data set.
    pub truth: BTreeMap<String, Truth>,
}

/// A trajectory that predictions are drawn beside.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Sample times [s].
    pub time: Vec<f32>,
    /// The true force, one row a sample [N, N m].
    pub force: Vec<Vec<f32>>,
}
