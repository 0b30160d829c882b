//! The paper's experiments, whole: which models are trained on what, what is asked of each, and what all of it says.
//!
//! ```text
//! plan -> (training) -> examination of one model, a job's result -> summary over seeds, orderings with their confidence
//! ```
//!
//! Nothing here touches a file or a simulator: the command line trains, drives MuJoCo and writes.
//!
//! C. Wang, A. Liang, F. Han, X. Zeng, Z. Li, D. Fan, J. Kober, "Learning Adaptive Hydrodynamic Models Using
//! Neural ODEs in Complex Conditions", section Experiments.

mod attention;
mod cost;
mod detail;
mod energy;
mod examination;
mod fluctuation;
mod noise;
mod ordering;
mod plan;
mod prediction;
mod summary;
#[cfg(test)]
mod tests;

pub use self::{
    attention::attention_by_lag,
    cost::{Cost, ROUNDS, Timed, time},
    detail::Detail,
    energy::Energy,
    examination::{Beyond, Examination, Noisy, Swimming, examine},
    ordering::{Ordering, order},
    plan::{Budget, Entry, Experiment, JobId, LearningRates, UnknownExperiment, entries},
    summary::{
        Comparison, JobResult, MeanSd, Metric, Reference, Row, SCHEMA, TrainingNote, Truth,
        summarise,
    },
};
