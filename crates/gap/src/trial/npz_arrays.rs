//! Arrays of an untrusted `.npz`, with the errors of a trial.

use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use hydro_files::{Array, NpzError};

use super::{TrialError, kinds::open};

/// Largest archive [byte].
const LARGEST_FILE: u64 = 1 << 33;

/// An opened `.npz`.
pub(super) struct Archive {
    path: PathBuf,
    npz: hydro_files::Archive<BufReader<File>>,
}

impl Archive {
    pub(super) fn open(path: &Path) -> Result<Self, TrialError> {
        let file = open(path, LARGEST_FILE)?;
        let npz = hydro_files::Archive::open(BufReader::new(file));
        let npz = npz.map_err(|error| refusal(path, error))?;
        let path = path.to_owned();
        Ok(Self { path, npz })
    }

    /// Names of the arrays, sorted.
    pub(super) fn names(&self) -> Vec<String> {
        self.npz.names()
    }

    /// Numbers of any width and byte order; `None` where there is no such array.
    pub(super) fn numbers(&mut self, array: &str) -> Result<Option<Array>, TrialError> {
        let found = self.npz.numbers(array);
        found.map_err(|error| refusal(&self.path, error))
    }

    /// Numbers of a required array.
    pub(super) fn required(&mut self, array: &str) -> Result<Array, TrialError> {
        let found = self.npz.required(array);
        found.map_err(|error| refusal(&self.path, error))
    }

    /// A single string; `None` where there is no such array.
    pub(super) fn text(&mut self, array: &str) -> Result<Option<String>, TrialError> {
        let found = self.npz.text(array);
        found.map_err(|error| refusal(&self.path, error))
    }
}

fn refusal(path: &Path, error: NpzError) -> TrialError {
    let path = path.to_owned();
    match error {
        NpzError::Missing { array, found } => TrialError::MissingArray { path, array, found },
        NpzError::Pickled { array } => TrialError::Pickled { path, array },
        NpzError::ElementType {
            array,
            found,
            expected,
        } => TrialError::ElementType {
            path,
            array,
            found,
            expected,
        },
        NpzError::Damaged { array, reason } => TrialError::Damaged {
            path,
            place: array.map(|array| format!("array `{array}`")),
            reason,
        },
        error => TrialError::Damaged {
            path,
            place: None,
            reason: error.to_string(),
        },
    }
}
