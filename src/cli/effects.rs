//! `hydro effects`: files of effects, for the attribute `effects` of `hydro.wrench`.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Subcommand;
use hydro_effects::fossen::VehicleTable;

use super::output::write_line;

/// Flags of `hydro effects`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print the effects of a table of hydrodynamic derivatives (X_udot, Y_v, N_r|r|; TOML or JSON): added mass, linear and
    /// quadratic drag as whole matrices, with this library's signs and axes.
    FromFossen {
        /// The table.
        file: PathBuf,
        /// Name of the vehicle's body in the MJCF.
        #[arg(long)]
        target: String,
    },
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        Command::FromFossen { file, target } => {
            let place = || file.display().to_string();
            let text = hydro_files::read_text(file, hydro_files::TEXT).with_context(place)?;
            let effects = VehicleTable::parse(&text).and_then(|table| table.to_json(target));
            write_line(effects.with_context(place)?.trim_end())
        }
    }
}
