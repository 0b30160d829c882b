//! The program, run as a user runs it from the repository's root.
#![cfg(feature = "cli")]

use std::{
    ffi::OsStr,
    process::{Command, Output},
};

pub(crate) fn hydro(arguments: &[impl AsRef<OsStr>]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hydro"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap()
}

/// All that it wrote to standard error.
pub(crate) fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
