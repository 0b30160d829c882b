//! Why a trial was refused: what was found, where, what was expected, what the model has.

use std::{fmt, path::PathBuf};

use thiserror::Error;

use super::columns::counted;

/// Where in a file a row stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Row of an array, counted from 0 as NumPy does.
    Row(usize),
    /// Line of a text file, counted from 1 as editors do.
    Line(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Row(row) => write!(f, "row {row} (from 0)"),
            Self::Line(line) => write!(f, "line {line}"),
        }
    }
}

/// Why a trial, or a folder of them, was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TrialError {
    /// A file or folder is missing, or the system does not let it be read or written.
    #[error("{path}: {reason}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// A file that is neither.
    #[error("{path}: a trial is a .npz or a .csv file", path = path.display())]
    Ending {
        /// The file.
        path: PathBuf,
    },
    /// A folder without a trial.
    #[error("{path}: no trial in this folder; expected .npz or .csv files, found {found}", path = path.display())]
    NoTrials {
        /// The folder.
        path: PathBuf,
        /// What is there instead.
        found: String,
    },
    /// Two files of one name.
    #[error("{path} and {other}: two trials named `{name}`; the name of the file names the trial, rename one",
        path = path.display(), other = other.display())]
    SameName {
        /// One file.
        path: PathBuf,
        /// The other.
        other: PathBuf,
        /// Their name.
        name: String,
    },
    /// Too few rows.
    #[error("{path}: {what}: {found}, expected at least {expected}", path = path.display(), found = counted(*found as u64, "row"))]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is short of rows.
        what: String,
        /// How many there are.
        found: usize,
        /// How many there must be.
        expected: usize,
    },
    /// The file is damaged, cut short, or of another format than its ending says.
    #[error("{path}: {place}{reason}", path = path.display(), place = in_front(place))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The array or line, where one is to blame.
        place: Option<String>,
        /// What is wrong.
        reason: String,
    },
    /// An array is missing.
    #[error("{path}: no array `{array}`, which `SystemTrajectory.save_to_disk` writes; arrays here: {found}", path = path.display())]
    MissingArray {
        /// The file.
        path: PathBuf,
        /// The array.
        array: String,
        /// The arrays that exist.
        found: String,
    },
    /// An array of Python objects.
    #[error("{path}: array `{array}` holds pickled Python objects, which may run code when they are read, and are not; \
        store numbers, or leave the array out where it is None", path = path.display())]
    Pickled {
        /// The file.
        path: PathBuf,
        /// The array.
        array: String,
    },
    /// An array of another element type.
    #[error("{path}: array `{array}` has elements {found}; expected {expected}", path = path.display())]
    ElementType {
        /// The file.
        path: PathBuf,
        /// The array.
        array: String,
        /// Its dtype, as NumPy writes it.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// An array of the wrong shape.
    #[error("{path}: array `{array}` has shape {found:?}; expected {expected}", path = path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// The array.
        array: String,
        /// Its shape.
        found: Vec<u64>,
        /// What it should be, and why.
        expected: String,
    },
    /// A signal mapping that does not fit its array.
    #[error("{path}: `{array}`: {reason}", path = path.display())]
    Mapping {
        /// The file.
        path: PathBuf,
        /// The array.
        array: String,
        /// What is wrong.
        reason: String,
    },
    /// No column of times.
    #[error("{path}: no column `time` [s]; columns: {found}{hint}", path = path.display())]
    NoTime {
        /// The file.
        path: PathBuf,
        /// The columns.
        found: String,
        /// What may be the matter, or nothing.
        hint: &'static str,
    },
    /// A signal that the model does not have.
    #[error("{path}: column `{column}` is nothing that the model has{hint}; {model}",
        path = path.display(), hint = did_you_mean(nearest))]
    UnknownColumn {
        /// The file.
        path: PathBuf,
        /// The column or signal.
        column: String,
        /// The name in the model that it resembles.
        nearest: Option<String>,
        /// What the model has.
        model: String,
    },
    /// A column that two signals of the model may mean.
    #[error("{path}: column `{column}` may be the actuator or the sensor of that name; call the actuator's `{column}_ctrl`", path = path.display())]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// Two columns for one signal.
    #[error("{path}: two columns for `{column}`: `{first}` and `{second}`", path = path.display())]
    Twice {
        /// The file.
        path: PathBuf,
        /// The signal.
        column: String,
        /// A column.
        first: String,
        /// Another.
        second: String,
    },
    /// Controls that the log lacks: without them nothing can be replayed.
    #[error("{path}: no column for the actuators {missing}; controls here: {found}; {model}", path = path.display())]
    MissingActuator {
        /// The file.
        path: PathBuf,
        /// The actuators without a column or without a sample.
        missing: String,
        /// The actuators that have one.
        found: String,
        /// What the model has.
        model: String,
    },
    /// Nothing to compare.
    #[error("{path}: no sensor of the model has a sample in this file; {model}", path = path.display())]
    NoSensors {
        /// The file.
        path: PathBuf,
        /// What the model has.
        model: String,
    },
    /// Another number of columns than the model has.
    #[error("{path}: {what}: {found}, expected {expected}; {model}", path = path.display(), found = counted(*found as u64, "column"))]
    Width {
        /// The file.
        path: PathBuf,
        /// The array or signal.
        what: String,
        /// How many columns it has.
        found: usize,
        /// How many it should have.
        expected: String,
        /// What the model has.
        model: String,
    },
    /// A cell that is no number.
    #[error("{path}: {place}, column `{column}`: `{found}` is no number; leave the cell empty where there is no sample", path = path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The row.
        place: Place,
        /// The column.
        column: String,
        /// What the cell holds.
        found: String,
    },
    /// NaN or infinity where a number must be.
    #[error("{path}: {place}, column `{column}`: {found} is not finite{hint}", path = path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The row.
        place: Place,
        /// The column.
        column: String,
        /// The value.
        found: f64,
        /// The way out, or nothing.
        hint: &'static str,
    },
    /// Time that stands still or runs backwards.
    #[error("{path}: {place}, column `{column}`: time {verb} from {before} s to {found} s; expected to increase from row to row",
        path = path.display(), verb = if found < before { "runs backwards" } else { "stands still" })]
    TimeOrder {
        /// The file.
        path: PathBuf,
        /// The later row.
        place: Place,
        /// The column or array of times.
        column: String,
        /// Time of the row before [s].
        before: f64,
        /// Time of the row [s].
        found: f64,
    },
    /// A quaternion that is no rotation.
    #[error("{path}: sensor `{sensor}`: the median length of its quaternions is {found:.4}, expected 1 within {tolerance}; \
        other units or other columns suspected", path = path.display())]
    Quaternion {
        /// The file.
        path: PathBuf,
        /// The sensor.
        sensor: String,
        /// Median length.
        found: f64,
        /// Largest accepted departure from 1.
        tolerance: f64,
    },
    /// An angle too large to be one in radians.
    #[error("{path}: {place}, column `{column}`: {found}, expected radians; degrees suspected, since the angle reaches {turns:.1} turns and comes back", path = path.display())]
    Degrees {
        /// The file.
        path: PathBuf,
        /// The row of the largest angle.
        place: Place,
        /// The column.
        column: String,
        /// The largest angle.
        found: f64,
        /// The same in turns, were it radians.
        turns: f64,
    },
    /// A trial that the format cannot hold.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

fn in_front(place: &Option<String>) -> String {
    place
        .as_ref()
        .map_or_else(String::new, |place| format!("{place}: "))
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}
