//! Standard output and standard error.

use anyhow::Context as _;

/// `println!` that fails like any other write: a full disk is an error, a closed pipe the end.
macro_rules! say {
    ($($word:tt)*) => {
        $crate::cli::output::write_line(&format!($($word)*))?
    };
}

/// Prints an error and its causes on one line.
pub(crate) fn print_error(error: &anyhow::Error) {
    eprintln!("hydro: {error:#}");
}

/// Prints one machine-readable result.
pub(super) fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    write_line(&serde_json::to_string_pretty(value)?)
}

/// Writes a line to standard output; a reader that has gone away ends the program quietly.
pub(super) fn write_line(line: &str) -> anyhow::Result<()> {
    use std::io::Write as _;
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        result => result.context("writing to standard output"),
    }
}
