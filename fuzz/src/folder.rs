//! A scratch folder of the thread, for what reads files.

use std::{fs, path::PathBuf};

use tempfile::TempDir;

thread_local! {
    static FOLDER: TempDir = tempfile::tempdir().expect("a scratch folder");
}

/// The folder.
pub(super) fn path() -> PathBuf {
    FOLDER.with(|folder| folder.path().to_owned())
}

/// Writes a file into the folder, and gives its path.
pub(super) fn put(name: &str, bytes: &[u8]) -> PathBuf {
    let path = path().join(name);
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).expect("a folder inside");
    }
    fs::write(&path, bytes).expect("a file inside");
    path
}
