//! `hydro gap`: find where simulation and measurement disagree, name the missing effect, add it, verify.

#[cfg(mujoco_plugins)]
mod bars;
mod effects;
#[cfg(mujoco_plugins)]
mod folder;
#[cfg(mujoco_plugins)]
mod inputs;
#[cfg(mujoco_plugins)]
mod laboratory;
#[cfg(mujoco_plugins)]
mod lines;
#[cfg(mujoco_plugins)]
mod report;
#[cfg(mujoco_plugins)]
mod residual;
#[cfg(mujoco_plugins)]
mod sequence;
#[cfg(mujoco_plugins)]
mod settings;

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
    Run(settings::Flags),
    /// Where simulation and measurement disagree.
    #[cfg(mujoco_plugins)]
    Find(settings::Flags),
    /// Which effect is missing; runs what must come before where --out does not hold it.
    #[cfg(mujoco_plugins)]
    Name(settings::Flags),
    /// Writes a candidate model with the effect; runs what must come before.
    #[cfg(mujoco_plugins)]
    Add(settings::Flags),
    /// Held-out trials decide; runs what must come before, and writes verdict and report.
    #[cfg(mujoco_plugins)]
    Verify(settings::Flags),
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
            laboratory::run(flags, sequence::Stage::Verify)
        }
        #[cfg(mujoco_plugins)]
        Command::Find(flags) => laboratory::run(flags, sequence::Stage::Find),
        #[cfg(mujoco_plugins)]
        Command::Name(flags) => laboratory::run(flags, sequence::Stage::Name),
        #[cfg(mujoco_plugins)]
        Command::Add(flags) => laboratory::run(flags, sequence::Stage::Add),
        #[cfg(mujoco_plugins)]
        Command::Report(flags) => report::run(flags),
        Command::Effects(flags) => effects::run(flags),
    }
}

#[cfg(all(test, mujoco_plugins))]
mod tests;
