//! One training with its examination: its name and its result.

use std::{collections::BTreeMap, fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use super::examination::Examination;
use crate::trainer::TrainConfig;

/// Schema of a job's result.
pub const SCHEMA: &str = "hydro-compare-job/1";

/// One training and its examination.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct JobId {
    /// Name of the data set.
    pub data: String,
    /// [`Entry::id`].
    pub entry: String,
    /// Seed of the first weights and of the order of the data.
    pub seed: u64,
}

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/seed-{}", self.data, self.entry, self.seed)
    }
}

impl FromStr for JobId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let read = || {
            let mut parts = text.split('/');
            let (data, entry) = (parts.next()?, parts.next()?);
            let seed = parts.next()?.strip_prefix("seed-")?.parse().ok()?;
            parts.next().is_none().then(|| Self {
                data: data.to_owned(),
                entry: entry.to_owned(),
                seed,
            })
        };
        read().ok_or_else(|| format!("job `{text}`: expected DATA/ENTRY/seed-N, as 2/lstm/seed-0"))
    }
}

/// One job, done.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct JobResult {
    /// [`SCHEMA`].
    pub schema: String,
    /// Which one.
    pub job: JobId,
    /// Its data set's manifest.
    pub data_sha256: String,
    /// Digests of the other data it was examined on, by name: rollouts, and data sets outside the training range.
    pub examined_on: BTreeMap<String, String>,
    /// Settings of its training.
    pub settings: TrainConfig,
    /// Numbers in the weights.
    pub parameters: usize,
    /// Length and cost of a training.
    pub training: TrainingNote,
    /// Results of the examination.
    pub examination: Examination,
}

/// Length and cost of a training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingNote {
    /// Passes over the training split.
    pub epochs: usize,
    /// Wall clock over all epochs [s], with `threads` threads; other jobs may have run beside it.
    pub seconds: f64,
    /// Threads.
    pub threads: usize,
    /// Greatest resident memory of the process, data and all [MiB]; None where the system does not say.
    pub peak_memory_mib: Option<f64>,
    /// Best pooled nRMSE on the validation split; None where none was a number.
    pub validation: Option<f64>,
}

#[cfg(test)]
#[path = "tests/job.rs"]
mod tests;
