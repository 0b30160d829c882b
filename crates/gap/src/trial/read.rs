//! A trial read from a file, by the ending of its name.

use std::path::Path;

use super::{
    Remark, Signature, Trial, TrialError, assemble::assemble, csv, file_name::ending, npz,
};

/// Reads and checks a trial.
///
/// # Errors
/// A file that cannot be read, does not fit the model, or cannot be a measurement of it.
pub fn read(path: &Path, signature: &Signature) -> Result<(Trial, Vec<Remark>), TrialError> {
    let parts = match ending(path).as_deref() {
        Some("npz") => npz::read(path, signature)?,
        Some("csv") => csv::read(path, signature)?,
        _ => {
            return Err(TrialError::Ending {
                path: path.to_owned(),
            });
        }
    };
    assemble(path, signature, parts)
}
