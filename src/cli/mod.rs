//! The command line: one file a command, each turning flags into a checked configuration and one
//! library call. Only here may anything be printed.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::exit,
    reason = "the one room that talks to people"
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

/// Parses the command line and runs the command.
pub(crate) fn run() -> anyhow::Result<()> {
    match Cli::parse().command {
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
