//! Opening a file of a trial after a look at its kind and size.

use std::{
    fs::File,
    io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom},
    path::Path,
};

use super::TrialError;

/// Longest first line of a table [byte].
const LONGEST_LINE: u64 = 1 << 20;
/// Largest table [byte].
const LARGEST_TABLE: u64 = 1 << 32;

/// A file that is one, not empty, and not larger than `most`.
pub(super) fn open(path: &Path, most: u64) -> Result<File, TrialError> {
    let (file, size) = hydro_files::open(path, most).map_err(|error| io(path, &error))?;
    if size == 0 {
        return Err(damaged(path, "the file is empty".to_owned()));
    }
    Ok(file)
}

/// A table, read from its start. Its first line is not longer than a list of names can be: a file without any line is taken into
/// memory whole by the reader of lines.
pub(super) fn open_table(path: &Path) -> Result<BufReader<File>, TrialError> {
    let mut reader = BufReader::new(open(path, LARGEST_TABLE)?);
    let mut first = Vec::new();
    let length = (&mut reader)
        .take(LONGEST_LINE)
        .read_until(b'\n', &mut first)
        .map_err(|error| io(path, &error))?;
    if length as u64 == LONGEST_LINE {
        return Err(damaged(
            path,
            format!("its first line has {LONGEST_LINE} bytes or more; expected names of columns"),
        ));
    }
    reader
        .seek(SeekFrom::Start(0))
        .map_err(|error| io(path, &error))?;
    Ok(reader)
}

fn io(path: &Path, error: &std::io::Error) -> TrialError {
    TrialError::Io {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}

fn damaged(path: &Path, reason: String) -> TrialError {
    TrialError::Damaged {
        path: path.to_owned(),
        place: None,
        reason,
    }
}
