//! Errors of reading and writing trials: the place, what was found and what was expected.

use std::{fmt, path::PathBuf};

use hydro_files::number;
use thiserror::Error;

use super::message::counted;

/// Where in a file a row stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowPlace {
    /// Row of an array, counted from 0 as NumPy does.
    Row(usize),
    /// Line of a text file, counted from 1 as editors do.
    Line(u64),
}

impl fmt::Display for RowPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Row(row) => write!(f, "row {row} (from 0)"),
            Self::Line(line) => write!(f, "line {line}"),
        }
    }
}

/// A trial, or a folder of trials, is refused. Times are in [s].
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum TrialError {
    /// A file or folder is missing, or the system does not let it be read or written.
    #[error("{path}: {reason}", path = path.display())]
    Io { path: PathBuf, reason: String },
    /// A file that is neither .npz nor .csv.
    #[error("{path}: a trial is a .npz or a .csv file", path = path.display())]
    Ending { path: PathBuf },
    /// A folder without a trial.
    #[error("{path}: no trial in this folder; expected .npz or .csv files, found {found}", path = path.display())]
    NoTrials { path: PathBuf, found: String },
    /// Two files of one name.
    #[error("{path} and {other}: two trials named `{name}`; the name of the file names the trial, rename one",
        path = path.display(), other = other.display())]
    SameName {
        path: PathBuf,
        other: PathBuf,
        name: String,
    },
    /// Too few rows.
    #[error("{path}: {what}: {found}, expected at least {expected}", path = path.display(), found = counted(*found as u64, "row"))]
    Empty {
        path: PathBuf,
        what: String,
        found: usize,
        expected: usize,
    },
    /// The file is damaged, cut short, or of another format than its ending says.
    #[error("{path}: {place}{reason}", path = path.display(), place = in_front(place))]
    Damaged {
        path: PathBuf,
        place: Option<String>,
        reason: String,
    },
    /// An array is missing.
    #[error("{path}: no array `{array}`, which `SystemTrajectory.save_to_disk` writes; arrays here: {found}", path = path.display())]
    MissingArray {
        path: PathBuf,
        array: String,
        found: String,
    },
    /// An array of Python objects.
    #[error("{path}: array `{array}` holds pickled Python objects, which may run code when they are read, and are not; \
        store numbers, or leave the array out where it is None", path = path.display())]
    Pickled { path: PathBuf, array: String },
    /// An array of another element type.
    #[error("{path}: array `{array}` has elements {found}; expected {expected}", path = path.display())]
    ElementType {
        path: PathBuf,
        array: String,
        found: String,
        expected: &'static str,
    },
    /// An array of the wrong shape.
    #[error("{path}: array `{array}` has shape {found:?}; expected {expected}", path = path.display())]
    Shape {
        path: PathBuf,
        array: String,
        found: Vec<u64>,
        expected: String,
    },
    /// A signal mapping that does not fit its array.
    #[error("{path}: `{array}`: {reason}", path = path.display())]
    Mapping {
        path: PathBuf,
        array: String,
        reason: String,
    },
    /// No column of times.
    #[error("{path}: no column `time` [s]; columns: {found}{hint}", path = path.display())]
    NoTime {
        path: PathBuf,
        found: String,
        hint: &'static str,
    },
    /// A column that belongs to nothing of the model.
    #[error("{path}: column `{column}` is nothing that the model has{hint}; {model}",
        path = path.display(), hint = did_you_mean(nearest))]
    UnknownColumn {
        path: PathBuf,
        column: String,
        nearest: Option<String>,
        model: String,
    },
    /// A column that two signals of the model may mean.
    #[error("{path}: column `{column}` may be the actuator or the sensor of that name; call the actuator's `{column}_ctrl`", path = path.display())]
    Ambiguous { path: PathBuf, column: String },
    /// Two columns for one signal.
    #[error("{path}: two columns for `{column}`: `{first}` and `{second}`", path = path.display())]
    Twice {
        path: PathBuf,
        column: String,
        first: String,
        second: String,
    },
    /// Actuators without a control in the log, so that it cannot be replayed.
    #[error("{path}: no column for the actuators {missing}; controls here: {found}; {model}", path = path.display())]
    MissingActuator {
        path: PathBuf,
        missing: String,
        found: String,
        model: String,
    },
    /// No sensor with a sample.
    #[error("{path}: no sensor of the model has a sample in this file; {model}", path = path.display())]
    NoSensors { path: PathBuf, model: String },
    /// Another number of columns than the model has.
    #[error("{path}: {what}: {found}, expected {expected}; {model}", path = path.display(), found = counted(*found as u64, "column"))]
    Width {
        path: PathBuf,
        what: String,
        found: usize,
        expected: String,
        model: String,
    },
    /// A cell that is no number.
    #[error("{path}: {place}, column `{column}`: `{found}` is no number; leave the cell empty where there is no sample", path = path.display())]
    NotANumber {
        path: PathBuf,
        place: RowPlace,
        column: String,
        found: String,
    },
    /// NaN or infinity where a number must be.
    #[error("{path}: {place}, column `{column}`: {found} is not finite{hint}", path = path.display())]
    NotFinite {
        path: PathBuf,
        place: RowPlace,
        column: String,
        found: f64,
        hint: &'static str,
    },
    /// Time that stands still or runs backwards.
    #[error("{path}: {place}, column `{column}`: time {verb} from {before} s to {found} s; expected to increase from row to row",
        path = path.display(), verb = if found < before { "runs backwards" } else { "stands still" },
        before = number(*before), found = number(*found))]
    TimeOrder {
        path: PathBuf,
        place: RowPlace,
        column: String,
        before: f64,
        found: f64,
    },
    /// A quaternion that is no rotation.
    #[error("{path}: sensor `{sensor}`: the median length of its quaternions is {found:.4}, expected 1 within {tolerance}; \
        other units or other columns suspected", path = path.display())]
    Quaternion {
        path: PathBuf,
        sensor: String,
        found: f64,
        tolerance: f64,
    },
    /// A quaternion without all of its components, of which nothing can be compared.
    #[error("{path}: sensor `{sensor}` is a quaternion and the log lacks {missing}; give all four columns, or none", path = path.display())]
    PartialQuaternion {
        path: PathBuf,
        sensor: String,
        missing: String,
    },
    /// A log of more steps of the model than can be meant.
    #[error("{path}: {place}, column `{column}`: the log lasts {seconds:?} s with {period:?} s between rows, {steps:.2e} \
        steps of the model's {} s; expected seconds, milliseconds suspected", number(*timestep), path = path.display())]
    TooLong {
        path: PathBuf,
        place: RowPlace,
        column: String,
        seconds: f64,
        period: f64,
        steps: f64,
        timestep: f64,
    },
    /// Rows that no log has so close together.
    #[error("{path}: {place}, column `{column}`: {} s between rows, {share:.0} rows in each of the model's steps of {} s; \
        expected seconds, another unit suspected", number(*period), number(*timestep), path = path.display())]
    TooDense {
        path: PathBuf,
        place: RowPlace,
        column: String,
        period: f64,
        share: f64,
        timestep: f64,
    },
    /// An angle too large to be one in radians.
    #[error("{path}: {place}, column `{column}`: {found}, expected radians; degrees suspected, since the angle reaches {turns:.1} turns and comes back", path = path.display())]
    Degrees {
        path: PathBuf,
        place: RowPlace,
        column: String,
        found: f64,
        turns: f64,
    },
    /// A table of steady states that does not hold together.
    #[error("{path}: {reason}", path = path.display())]
    Table { path: PathBuf, reason: String },
    /// A prescribed joint whose samples do not make a trajectory.
    #[error("{path}: prescribed joint `{joint}`: {reason}", path = path.display())]
    Prescribed {
        path: PathBuf,
        joint: String,
        reason: String,
    },
    /// A trial that the format cannot hold.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Unwritable { path: PathBuf, reason: String },
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
