//! The trials of a folder, listed without opening any, so that held-out trials stay unread.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    Remark, Signature, Trial, TrialError,
    file_name::{ending, trial_name},
    message::listed,
    read::read,
};

/// A trial in a folder, not opened.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Listed {
    /// Its name: that of the file without the ending.
    pub name: String,
    /// The file.
    pub path: PathBuf,
}

/// The trials of a folder, sorted by name; their content is not read. Hidden files and files with other endings are
/// skipped.
///
/// # Errors
/// Where the folder cannot be read, holds no trial, or holds two of one name.
pub fn list(folder: &Path) -> Result<Vec<Listed>, TrialError> {
    let io = |source: std::io::Error| TrialError::Io {
        path: folder.to_owned(),
        reason: source.to_string(),
    };
    let mut trials = Vec::new();
    let mut others = Vec::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let is_trial = matches!(ending(&path).as_deref(), Some("npz" | "csv"));
        if is_trial && !file.starts_with('.') && path.is_file() {
            let name = trial_name(&path);
            trials.push(Listed { name, path });
        } else {
            others.push(file.into_owned());
        }
    }
    if trials.is_empty() {
        others.sort();
        return Err(TrialError::NoTrials {
            path: folder.to_owned(),
            found: listed(&others),
        });
    }
    trials.sort();
    if let Some(pair) = trials.windows(2).find(|pair| pair[0].name == pair[1].name) {
        return Err(TrialError::SameName {
            path: pair[0].path.clone(),
            other: pair[1].path.clone(),
            name: pair[0].name.clone(),
        });
    }
    Ok(trials)
}

/// Reads every trial of a folder, sorted by name, with its remarks.
///
/// # Errors
/// As [`list`] and [`read`], at the first trial that is refused.
pub fn read_folder(
    folder: &Path,
    signature: &Signature,
) -> Result<Vec<(Trial, Vec<Remark>)>, TrialError> {
    let trials = list(folder)?;
    trials
        .iter()
        .map(|trial| read(&trial.path, signature))
        .collect()
}
