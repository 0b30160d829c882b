//! Writing a trial, for every format: checks before, and a file that is there whole or not at all.

use std::{
    fs::File,
    io::{BufWriter, Result},
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

/// Lets `fill` write the file through a buffer, so that `path` never holds half a trial.
pub(super) fn whole(
    path: &Path,
    fill: impl FnOnce(BufWriter<&mut File>) -> Result<()>,
) -> std::result::Result<(), TrialError> {
    hydro_files::write_whole_with(path, |file| fill(BufWriter::new(file))).map_err(|source| {
        TrialError::Io {
            path: path.to_owned(),
            reason: source.to_string(),
        }
    })
}
