//! The paper's experiments: models and data sets, the training budget, examinations, and tables over seeds.
//!
//! ```text
//! entries, budget -> (training) -> examination of one model, a job's result -> table over seeds, orderings
//! ```
//!
//! Nothing here touches a file or a simulator: the command line trains, drives MuJoCo and writes.
//!
//! C. Wang, A. Liang, F. Han, X. Zeng, Z. Li, D. Fan, J. Kober, "Learning Adaptive Hydrodynamic Models Using
//! Neural ODEs in Complex Conditions", section Experiments.

mod budget;
mod claims;
mod cost;
mod detail;
mod energy;
mod entries;
mod examination;
mod fluctuation;
mod job;
mod mean_sd;
mod noise;
mod ordering;
mod predictor;
mod results;
mod table;
mod task;
#[cfg(test)]
#[path = "tests/measures.rs"]
mod tests;
mod yardsticks;

pub use self::{
    budget::Budget,
    cost::{Cost, ROUNDS, Timed, time_engines},
    detail::Detail,
    energy::Energy,
    entries::{Entry, LearningRates, entries},
    examination::{Examination, Noisy, OutOfRange, Swimming, examine},
    job::{JobId, JobResult, SCHEMA, TrainingNote},
    mean_sd::MeanSd,
    ordering::{Ordering, ordering},
    results::{ExperimentResults, Truth},
    table::{Metric, Reference, Row, summarise},
    task::{Experiment, UnknownExperiment},
    yardsticks::yardsticks,
};
