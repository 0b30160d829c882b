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

/// The message of a command that must be refused: without a panic or an abort, and in three lines at most.
pub(crate) fn refused(output: &Output) -> String {
    let text = message(output);
    let status = output.status.code();
    assert!(
        status.is_some_and(|status| status > 0),
        "{status:?}: {text}"
    );
    assert!(!text.contains("panicked"), "{text}");
    let lines: Vec<&str> = text.trim().lines().collect();
    match lines.iter().rposition(|line| line.starts_with("hydro: ")) {
        Some(at) => assert!(lines.len() - at <= 3, "{text}"),
        None => assert_eq!(status, Some(2), "neither hydro's nor clap's: {text}"),
    }
    text
}
