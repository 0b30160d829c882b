//! `hydro gap`: find where simulation and measurement disagree, name the missing effect, add it, verify.

#[cfg(mujoco_plugins)]
mod bars;
#[cfg(mujoco_plugins)]
mod candidate;
mod effects;
#[cfg(mujoco_plugins)]
mod flags;
#[cfg(mujoco_plugins)]
mod inputs;
#[cfg(mujoco_plugins)]
mod left_out;
mod own_effects;
#[cfg(mujoco_plugins)]
mod pipeline;
#[cfg(mujoco_plugins)]
mod report;
#[cfg(mujoco_plugins)]
mod residual_candidate;
#[cfg(mujoco_plugins)]
mod results_folder;
#[cfg(mujoco_plugins)]
mod session;
#[cfg(mujoco_plugins)]
mod terminal;

use clap::Subcommand;

/// Stages of `hydro gap`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// All stages: find, name, add, verify, report.
    #[cfg(mujoco_plugins)]
    Run(flags::Flags),
    /// Where simulation and measurement disagree.
    #[cfg(mujoco_plugins)]
    Find(flags::Flags),
    /// Which effect is missing; runs what must come before where --out does not hold it.
    #[cfg(mujoco_plugins)]
    Name(flags::Flags),
    /// Writes a candidate model with the effect; runs what must come before.
    #[cfg(mujoco_plugins)]
    Add(flags::Flags),
    /// Held-out trials decide; runs what must come before, and writes verdict and report.
    #[cfg(mujoco_plugins)]
    Verify(flags::Flags),
    /// Write report.html and verdict.json again from the stages in a folder.
    #[cfg(mujoco_plugins)]
    Report(report::Flags),
    /// The catalogue: every effect that can be named, with its parameters and units.
    Effects(effects::Flags),
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        #[cfg(mujoco_plugins)]
        Command::Run(flags) | Command::Verify(flags) => {
            session::run(flags, pipeline::Stage::Verify)
        }
        #[cfg(mujoco_plugins)]
        Command::Find(flags) => session::run(flags, pipeline::Stage::Find),
        #[cfg(mujoco_plugins)]
        Command::Name(flags) => session::run(flags, pipeline::Stage::Name),
        #[cfg(mujoco_plugins)]
        Command::Add(flags) => session::run(flags, pipeline::Stage::Add),
        #[cfg(mujoco_plugins)]
        Command::Report(flags) => report::run(flags),
        Command::Effects(flags) => effects::run(flags),
    }
}

#[cfg(all(test, mujoco_plugins))]
mod tests;
