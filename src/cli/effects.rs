//! `hydro effects`: files of effects, for the attribute `effects` of `hydro.wrench`.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Subcommand;
use hydro_effects::fossen::VehicleTable;
#[cfg(mujoco_plugins)]
use hydro_effects::from_hull::HullInWater;
#[cfg(mujoco_plugins)]
use hydro_plugin::{mujoco::simulator::Model, plugin::attributes::FRESH_WATER};

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
    #[cfg(mujoco_plugins)]
    /// Print first values from the shape of a body's geoms: hydrostatics, the added mass of an ellipsoid, drag by silhouette.
    /// Drag is good to a factor of two.
    FromShape {
        /// MJCF or URDF file.
        model: PathBuf,
        /// Name of the body.
        #[arg(long)]
        body: String,
        /// Density of the water [kg/m^3].
        #[arg(long, default_value_t = FRESH_WATER, value_parser = positive)]
        density: f64,
        /// Drag coefficient for the area of a silhouette.
        #[arg(long, default_value_t = 1.0, value_parser = positive)]
        drag_coefficient: f64,
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
        #[cfg(mujoco_plugins)]
        Command::FromShape {
            model,
            body,
            density,
            drag_coefficient,
        } => {
            let place = || model.display().to_string();
            let shape = Model::load(model)?.body_shape(body).with_context(place)?;
            let hull = HullInWater {
                hull: &shape.hull,
                middle: shape.middle,
                extent: shape.extent,
                density: *density,
                drag_coefficient: *drag_coefficient,
            };
            write_line(hull.to_json(body).with_context(place)?.trim_end())
        }
    }
}

#[cfg(mujoco_plugins)]
fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok();
    value
        .filter(|value| *value > 0.0 && value.is_finite())
        .ok_or_else(|| "expected a number above 0".to_owned())
}
