//! Writing a trial, for every format: checks before, and a file that is there whole or not at all.

use std::{
    fs::{File, Permissions},
    io::{BufWriter, Result},
    os::unix::fs::PermissionsExt as _,
    path::Path,
};

use super::{Part, Series, Trial, TrialError};

/// Refuses a trial that the file could not hold unchanged.
pub(super) fn check(path: &Path, trial: &Trial) -> std::result::Result<(), TrialError> {
    if trial.prescribed.is_some() || trial.steady.is_some() {
        return Err(TrialError::Unwritable {
            path: path.to_owned(),
            reason: "prescribed motion is read, but not written".to_owned(),
        });
    }
    let parts = [
        (Part::Control, Some(&trial.control)),
        (Part::Sensors, Some(&trial.sensors)),
        (Part::State, trial.state.as_ref()),
    ];
    for (part, series) in parts {
        if let Some(reason) = series.and_then(fault) {
            return Err(TrialError::Unwritable {
                path: path.to_owned(),
                reason: format!("{part}: {reason}"),
            });
        }
    }
    Ok(())
}

fn fault(series: &Series) -> Option<String> {
    let (rows, width, values) = (series.len(), series.width(), series.data.len());
    if rows * width != values {
        return Some(format!("{values} values in {rows} rows of {width} columns"));
    }
    let finite = series.times.iter().all(|time| time.is_finite());
    let increasing = series.times.windows(2).all(|pair| pair[0] < pair[1]);
    if !(finite && increasing) {
        return Some("times that do not increase from row to row".to_owned());
    }
    let mut names = series.columns.clone();
    names.sort();
    let twice = names.windows(2).find(|pair| pair[0] == pair[1])?;
    Some(format!("two columns named `{}`", twice[0]))
}

/// Lets `fill` write a file beside `path` and moves it there, so that `path` never holds half a trial.
pub(super) fn whole(
    path: &Path,
    fill: impl FnOnce(BufWriter<&mut File>) -> Result<()>,
) -> std::result::Result<(), TrialError> {
    let io = |source: std::io::Error| TrialError::Io {
        path: path.to_owned(),
        reason: source.to_string(),
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::Builder::new()
        .prefix(".trial-")
        // The usual permissions less what the user withholds; a temporary file has fewer.
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder)
        .map_err(io)?;
    fill(BufWriter::new(file.as_file_mut())).map_err(io)?;
    file.persist(path).map_err(|error| io(error.error))?;
    Ok(())
}
