//! Tables of a trial as a reader found them.

use std::path::Path;

use super::{RemarkKind, RowPlace, Series, TrialError};

/// The tables of a file; widths and names fit the model, columns are in its order.
pub(super) struct Parts {
    /// One column for every actuator.
    pub(super) control: Table,
    /// Columns of the sensors that the file has.
    pub(super) sensors: Table,
    /// The state at the start, full-physics.
    pub(super) initial_state: Option<Vec<f64>>,
    /// States along the run.
    pub(super) state: Option<Table>,
    /// Positions of prescribed joints; NaN where one has no sample.
    pub(super) prescribed: Option<Table>,
    /// Oddities that the reader met.
    pub(super) remarks: Vec<RemarkKind>,
}

/// A series and the places of its rows in the file.
pub(super) struct Table {
    pub(super) series: Series,
    /// Name of the times in the file.
    pub(super) time_name: &'static str,
    /// The line of each row in a text file; absent for arrays.
    pub(super) lines: Option<Vec<u64>>,
}

impl Table {
    /// Place of a row in the file.
    pub(super) fn place(&self, row: usize) -> RowPlace {
        let line = self.lines.as_ref().and_then(|lines| lines.get(row));
        line.map_or(RowPlace::Row(row), |line| RowPlace::Line(*line))
    }

    /// Refuses a value that is neither finite nor `allowed`.
    pub(super) fn check_finite(
        &self,
        path: &Path,
        allowed: fn(f64) -> bool,
        hint: &'static str,
    ) -> Result<(), TrialError> {
        let mut values = self.series.data.iter();
        let Some(at) = values.position(|value| !(value.is_finite() || allowed(*value))) else {
            return Ok(());
        };
        let width = self.series.width();
        Err(TrialError::NotFinite {
            path: path.to_owned(),
            place: self.place(at / width),
            column: self.series.columns[at % width].clone(),
            found: self.series.data[at],
            hint,
        })
    }
}
