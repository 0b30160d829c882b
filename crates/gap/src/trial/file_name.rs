//! Parts of the name of a trial's file.

use std::{ffi::OsStr, path::Path};

/// The ending of a file's name, in lower case.
pub(super) fn ending(path: &Path) -> Option<String> {
    let ending = path.extension().and_then(OsStr::to_str)?;
    Some(ending.to_ascii_lowercase())
}

/// Name of the trial in a file: the file's without its ending.
pub(super) fn trial_name(path: &Path) -> String {
    path.file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default()
}
