//! The command line: a file a command, which turns flags into a checked configuration and one library
//! call. Nothing else in this crate prints.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::exit,
    reason = "the one room that talks to people"
)]

#[macro_use]
mod output;

mod cancel;
mod command_line;
mod compare;
mod doctor;
mod evaluate;
mod exit;
mod files;
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

use clap::{Parser, Subcommand};

use self::output::print_json;
#[cfg(mujoco_plugins)]
use self::{command_line::command_line, files::sha256, output::write_line};
pub(crate) use self::{exit::exit_status, output::print_error};

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
    /// Drive a robot under a learned wrench and compare it with the truth and with baselines.
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
