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
        Some("csv") => {
            csv::steady::check_name(path)?;
            if csv::steady::is_table(path, signature) {
                return table(path, signature, None);
            }
            csv::read(path, signature)?
        }
        _ => {
            return Err(TrialError::Ending {
                path: path.to_owned(),
            });
        }
    };
    assemble(path, signature, parts)
}

/// Reads a table of steady states, or a part of its rows.
pub(super) fn table(
    path: &Path,
    signature: &Signature,
    part: Option<(usize, usize)>,
) -> Result<(Trial, Vec<Remark>), TrialError> {
    let (trial, remarks) = csv::steady::read(path, signature, part)?;
    Ok((trial, remarks.into_iter().map(Remark::from).collect()))
}
