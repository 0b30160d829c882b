//! `hydro inspect`: description of a checkpoint, a data set, rollouts or a robot.

use std::path::{Path, PathBuf};

use anyhow::bail;
use hydro_model::{checkpoint::Checkpoint, robot::Robot, water::water_in_words};
use hydro_training::{dataset::Dataset, rollouts::Rollouts};

use super::{
    output::print_json,
    table::{facts, table},
};

mod checkpoint;

/// Flags of `hydro inspect`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of a checkpoint, a data set or rollouts, or a URDF file.
    path: PathBuf,
    /// Print the card, manifest or index as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let path = &args.path;
    if path.extension().is_some_and(|ending| ending == "urdf") {
        return robot(path);
    }
    if path.join("card.json").exists() {
        let card = Checkpoint::load(path)?;
        return if args.json {
            print_json(&card.card)
        } else {
            checkpoint::show(&card)
        };
    }
    if path.join("manifest.json").exists() {
        let data = Dataset::open(path)?;
        return if args.json {
            print_json(data.manifest())
        } else {
            dataset(&data)
        };
    }
    if path.join("rollouts.json").exists() {
        let all = Rollouts::load(path)?;
        return if args.json {
            print_json(&all.index)
        } else {
            rollouts(&all)
        };
    }
    bail!(
        "{}: expected a folder with card.json (checkpoint), manifest.json (data set) or rollouts.json, or a .urdf file",
        path.display()
    )
}

fn dataset(data: &Dataset) -> anyhow::Result<()> {
    let manifest = data.manifest();
    facts(&[
        ("data set", manifest.name.clone()),
        ("features", manifest.features.len().to_string()),
        ("outputs", manifest.outputs.join(" ")),
        (
            "torques of joints",
            match &manifest.generalised {
                Some(columns) => columns[manifest.outputs.len()..].join(" "),
                None => "none".to_owned(),
            },
        ),
        ("water", water_in_words(manifest.water.as_ref())),
        (
            "samples",
            format!(
                "{} a trajectory, every {} s",
                manifest.samples, manifest.sample_period
            ),
        ),
        ("manifest sha256", data.sha256().to_owned()),
    ])?;
    let rows: Vec<Vec<String>> = manifest
        .splits
        .iter()
        .map(|(name, split)| {
            vec![
                name.clone(),
                split.trajectories.to_string(),
                split.shards.len().to_string(),
            ]
        })
        .collect();
    say!("{}", table(&["split", "trajectories", "files"], &rows));
    Ok(())
}

fn rollouts(all: &Rollouts) -> anyhow::Result<()> {
    let index = &all.index;
    facts(&[
        ("rollouts", all.runs.len().to_string()),
        ("truth", index.model.clone()),
        ("MuJoCo", index.mujoco.clone()),
        ("command", index.command.clone()),
    ])?;
    let rows: Vec<Vec<String>> = index
        .rollouts
        .iter()
        .map(|run| {
            vec![
                run.file.clone(),
                format!("{:.1}", run.density),
                format!("{}", run.duration),
            ]
        })
        .collect();
    say!(
        "{}",
        table(&["file", "density [kg/m^3]", "duration [s]"], &rows)
    );
    Ok(())
}

fn robot(path: &Path) -> anyhow::Result<()> {
    let robot = Robot::from_urdf(path)?;
    facts(&[
        ("robot", robot.name.clone()),
        ("links", robot.links.len().to_string()),
        ("mass", format!("{:.3} kg", robot.mass())),
        (
            "displaced volume",
            format!(
                "{:.2} L (primitive collision shapes)",
                1e3 * robot.displaced_volume()
            ),
        ),
        ("joints", robot.joint_names().join(" ")),
    ])
}
