//! Log of a run: a JSON object a line, a line an epoch.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::TrainError;

/// One epoch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogRecord {
    /// Epoch, from 0.
    pub epoch: usize,
    /// Steps taken so far.
    pub step: usize,
    /// Mean training loss of the epoch (squared standard deviations).
    pub loss: f64,
    /// Learning rate of its last step.
    pub learning_rate: f64,
    /// Pooled normalised RMSE on the validation split, open loop over whole trajectories; `None` where that split is
    /// empty. Written as null there, and where it is no number.
    pub validation: Option<f64>,
    /// The same with hydrostatics taken out of the scale.
    pub validation_hydrodynamic: Option<f64>,
    /// The best `validation` so far; `None` where there is none.
    pub best: Option<f64>,
    /// Distance of the continuous adjoint's gradient, on the epoch's first batch and where it is followed, from that of
    /// the steps as taken, as a share of the latter's norm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adjoint_error: Option<f64>,
}

/// Writes `bytes` beside `path` and renames: a reader sees the old file or the new one.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> Result<(), TrainError> {
    hydro_files::write_whole(path, bytes).map_err(|source| TrainError::Io {
        path: path.to_owned(),
        source,
    })
}

/// Writes the whole log.
pub(super) fn write(path: &Path, records: &[LogRecord]) -> Result<(), TrainError> {
    let lines = records.iter().map(|record| {
        // A record is plain numbers; it always serialises.
        serde_json::to_string(record).unwrap_or_default() + "\n"
    });
    replace(path, lines.collect::<String>().as_bytes())
}
