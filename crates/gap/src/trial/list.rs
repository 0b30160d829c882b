//! The trials of a folder, listed without reading any number, so that held-out trials stay unread.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    Remark, Signature, Trial, TrialError,
    csv::steady::{is_table, part_name, table_rows},
    file_name::{ending, trial_name},
    message::listed,
    read::{read, table},
};

/// Parts of a table of steady states at most: each is left out once where every trial is judged by a fit without it.
const PARTS: usize = 10;

/// End of the name of the file that `hydro trials convert` keeps while it replaces trials.
const UNFINISHED: &str = ".unfinished";

/// A trial in a folder, not opened.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Listed {
    /// Its name: that of the file without the ending.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// Rows of a table of steady states that are this trial: those whose index leaves a remainder (first) on division by the
    /// number of parts (second).
    pub part: Option<(usize, usize)>,
}

/// The trials of a folder, sorted by name; their content is not read, but for the first line of a csv file and, of a table of
/// steady states, the number of its rows. Such a table is dealt out, row by row, into ten trials at most. Hidden files and
/// files with other endings are skipped.
///
/// # Errors
/// The folder cannot be read, holds no trial, two of one name, or those of a conversion that was cut short.
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
        if file.starts_with('.') && file.ends_with(UNFINISHED) {
            return Err(TrialError::Io {
                path: path.clone(),
                reason: "a conversion of a log was cut short here: run it again, and it ends"
                    .to_owned(),
            });
        }
        let is_trial = matches!(ending(&path).as_deref(), Some("npz" | "csv"));
        if is_trial && !file.starts_with('.') {
            let refused = |source: std::io::Error| TrialError::Io {
                path: path.clone(),
                reason: source.to_string(),
            };
            let about = fs::metadata(&path).map_err(refused)?;
            if about.is_dir() {
                others.push(file.into_owned());
                continue;
            }
            // A pipe or a device that is called a trial is not left out in silence.
            if !about.is_file() {
                hydro_files::open(&path, u64::MAX).map_err(refused)?;
            }
            let name = trial_name(&path);
            let rows = match ending(&path).as_deref() {
                Some("csv") => table_rows(&path).filter(|rows| *rows > 1),
                _ => None,
            };
            let Some(rows) = rows else {
                trials.push(Listed {
                    name,
                    path,
                    part: None,
                });
                continue;
            };
            let parts = rows.min(PARTS);
            trials.extend((0..parts).map(|place| Listed {
                name: part_name(&name, place),
                path: path.clone(),
                part: Some((place, parts)),
            }));
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
/// As [`list`] and [`read`](super::read()), at the first trial that is refused.
pub fn read_folder(
    folder: &Path,
    signature: &Signature,
) -> Result<Vec<(Trial, Vec<Remark>)>, TrialError> {
    let trials = list(folder)?;
    trials
        .iter()
        .map(|trial| read_listed(trial, signature))
        .collect()
}

/// Reads and checks a trial of a folder: of a table of steady states its part.
///
/// # Errors
/// As [`read`].
pub fn read_listed(
    trial: &Listed,
    signature: &Signature,
) -> Result<(Trial, Vec<Remark>), TrialError> {
    match trial.part {
        Some(_) if is_table(&trial.path, signature) => table(&trial.path, signature, trial.part),
        _ => read(&trial.path, signature),
    }
}
