//! The command line: one file a command, each turning options into a checked configuration and one library call. Nothing
//! else prints.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::exit,
    reason = "only the command line prints"
)]

/// `println!` that fails like any other write: a full disk is an error, a closed pipe the end.
macro_rules! say {
    ($($word:tt)*) => {
        $crate::cli::write_line(&format!($($word)*))?
    };
}

mod cancel;
mod compare;
mod doctor;
mod evaluate;
mod gap;
mod inspect;
mod model_flags;
mod progress;
#[cfg(mujoco_plugins)]
mod references;
#[cfg(mujoco_plugins)]
mod simulate;
#[cfg(mujoco_plugins)]
mod swim;
mod table;
mod train;

use std::path::Path;

use anyhow::Context as _;
use clap::{Parser, Subcommand};
use sha2::{Digest as _, Sha256};

/// Learned hydrodynamics for MuJoCo.
#[derive(Debug, Parser)]
#[command(name = "hydro", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Train a force model on a data set and write a checkpoint.
    Train(train::Args),
    /// Errors of a checkpoint on a data set, in open loop.
    Evaluate(evaluate::Args),
    /// The paper's experiments: train every model with every solver over seeds, and write the tables.
    Compare(compare::Args),
    /// Drive a robot under a learned wrench and compare it with the truth and with rivals.
    #[cfg(mujoco_plugins)]
    Simulate(simulate::Args),
    /// Find what a simulation lacks, name it, add it, verify.
    Gap(gap::Args),
    /// Describe a checkpoint, a data set or a folder of rollouts.
    Inspect(inspect::Args),
    /// Say which MuJoCo was found and whether the plugin works in it.
    Doctor(doctor::Args),
}

/// Parses the command line and runs the command; MuJoCo's warnings are counted and told in one line at the end.
pub(crate) fn run() -> anyhow::Result<()> {
    let command = Cli::parse().command;
    #[cfg(feature = "mujoco")]
    hydro_plugin::mujoco::warnings::count(|text| eprintln!("WARNING: {text}"));
    let result = run_command(command);
    #[cfg(feature = "mujoco")]
    if let Some(line) = warning_line(&hydro_plugin::mujoco::warnings::take_counts()) {
        eprintln!("{line}");
    }
    result
}

/// One line on MuJoCo's warnings by kind; `None` where there was none.
#[cfg(feature = "mujoco")]
fn warning_line(counts: &[(String, u64)]) -> Option<String> {
    let total: u64 = counts.iter().map(|(_, count)| count).sum();
    let kinds: Vec<String> = counts
        .iter()
        .map(|(kind, count)| format!("{kind} ({count})"))
        .collect();
    let often = match total {
        1 => "once".to_owned(),
        _ => format!("{total} times"),
    };
    (total > 0).then(|| format!("MuJoCo warned {often}: {}", kinds.join("; ")))
}

fn run_command(command: Command) -> anyhow::Result<()> {
    match command {
        Command::Train(args) => train::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Compare(args) => compare::run(&args),
        #[cfg(mujoco_plugins)]
        Command::Simulate(args) => simulate::run(&args),
        Command::Gap(args) => gap::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Doctor(args) => doctor::run(&args),
    }
}

/// Prints an error and its causes on one line.
pub(crate) fn print_error(error: &anyhow::Error) {
    eprintln!("hydro: {error:#}");
}

/// Prints one machine-readable result.
fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    write_line(&serde_json::to_string_pretty(value)?)
}

/// Writes a line to standard output; a reader that has gone away ends the program quietly.
fn write_line(line: &str) -> anyhow::Result<()> {
    use std::io::Write as _;
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        result => result.context("writing to standard output"),
    }
}

/// Writes beside and renames.
fn write_whole(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let beside = folder.join(format!(".{}.part", std::process::id()));
    let write = || -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        std::fs::write(&beside, bytes)?;
        std::fs::rename(&beside, path)
    };
    write()
        .inspect_err(|_| {
            // The first error is the one to report.
            let _ = std::fs::remove_file(&beside);
        })
        .with_context(|| format!("writing {}", path.display()))
}

/// In hexadecimal digits.
fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The command as it was typed, for cards and reports.
fn command_line() -> String {
    let quoted = |word: String| match word.contains(char::is_whitespace) {
        true => format!("'{word}'"),
        false => word,
    };
    let words = std::env::args().skip(1).map(quoted);
    std::iter::once("hydro".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(all(test, feature = "mujoco"))]
mod tests {
    use super::warning_line;

    #[test]
    fn warnings_are_one_line_by_kind() {
        assert_eq!(warning_line(&[]), None);
        let counts = [
            ("huge value in QACC".to_owned(), 40),
            ("contacts".to_owned(), 2),
        ];
        assert_eq!(
            warning_line(&counts).as_deref(),
            Some("MuJoCo warned 42 times: huge value in QACC (40); contacts (2)")
        );
        assert_eq!(
            warning_line(&counts[1..]).as_deref(),
            Some("MuJoCo warned 2 times: contacts (2)")
        );
    }
}
