//! `hydro gap`: find where simulation and measurement disagree, name the missing effect, add it, verify.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
    time::Instant,
};

use anyhow::{Context, bail};
use hydro_plugin::{
    effects::{
        Id, Target, TargetKind,
        card::{ActuatorScale, BodyScale, JointScale, SensorScale},
        catalogue,
    },
    gap::{self, Settings, Study, Uncertainty, Watch, stages::Record},
    mujoco::plant::MujocoPlant,
    patch,
    sim::plant::{Plant, PlantDescription, SensorKind},
    trial::{self, SensorQuantity, SensorSignature, Signature, Trial},
};

/// Flags of `hydro gap run`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// run
    #[arg(default_value = "run")]
    stage: String,
    /// Nominal MJCF.
    #[arg(long)]
    model: PathBuf,
    /// Folder of trials (.npz, .csv).
    #[arg(long)]
    trials: PathBuf,
    /// Output folder.
    #[arg(long)]
    out: PathBuf,
    /// How well the nominal is known (nominal.toml).
    #[arg(long)]
    uncertainty: Option<PathBuf>,
    /// Part of the trials that is held out.
    #[arg(long, default_value_t = 0.25)]
    holdout: f64,
    /// Seed of every draw.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

fn signature(model: &PlantDescription) -> Signature {
    Signature {
        actuators: model.actuators.iter().map(|a| a.name.clone()).collect(),
        sensors: model
            .sensors
            .iter()
            .map(|sensor| SensorSignature {
                name: sensor.name.clone(),
                dim: sensor.len,
                kind: match sensor.kind {
                    SensorKind::Quaternion => SensorQuantity::Quaternion,
                    SensorKind::JointPosition if sensor.unit == "rad" => SensorQuantity::Angle,
                    _ => SensorQuantity::Other,
                },
            })
            .collect(),
        state_len: model.state_len,
        timestep: model.timestep,
    }
}

/// Names of an effect's parameters, in their order; they do not depend on the target's sizes.
fn names(id: Id) -> Vec<String> {
    let effect = catalogue::effect(id);
    let target = example(effect.card().target);
    effect.parameters(&target).into_iter().map(|p| p.name).collect()
}

/// A target of plain sizes.
fn example(kind: TargetKind) -> Target {
    match kind {
        TargetKind::Body => Target::Body(BodyScale {
            mass: 1.0,
            inertia: [1.0; 3],
            extent: [1.0; 3],
            volume: 1e-3,
            density: 1000.0,
            gravity: 9.81,
            speed: 1.0,
            rate: 1.0,
        }),
        TargetKind::Joint => Target::Joint(JointScale {
            inertia: 1.0,
            torque: 1.0,
            speed: 1.0,
            travel: 1.0,
            slides: false,
        }),
        TargetKind::Actuator => Target::Actuator(ActuatorScale {
            command: 1.0,
            inflow: 1.0,
            step: 0.002,
        }),
        TargetKind::Sensor => Target::Sensor(SensorScale {
            dimension: 1,
            noise: 1.0,
            signal: 1.0,
            unit: "1",
            period: 0.01,
        }),
    }
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    if args.stage != "run" {
        bail!("`{}` is not a stage", args.stage);
    }
    let begin = Instant::now();
    let stop = AtomicBool::new(false);
    let watch = Watch {
        stop: &stop,
        tell: &|what, done, total| {
            if done == 1 || done == total || done % 20 == 0 {
                eprintln!("{:8.2} {what} {done}/{total}", begin.elapsed().as_secs_f64());
            }
        },
    };
    fs::create_dir_all(&args.out)?;
    let plant = MujocoPlant::load(&args.model)?;
    let model = plant.description();
    let uncertainty = match &args.uncertainty {
        Some(path) => Uncertainty::parse(&fs::read_to_string(path)?, &model.knobs)?,
        None => Uncertainty::default(),
    };
    let settings = Settings {
        uncertainty,
        seed: args.seed,
    };
    let signature = signature(model);
    let listed = trial::list(&args.trials)?;
    let all: Vec<String> = listed.iter().map(|of| of.name.clone()).collect();
    let split = trial::split(&all, args.holdout, args.seed);
    let read = |wanted: &[String]| -> anyhow::Result<Vec<Trial>> {
        listed
            .iter()
            .filter(|of| wanted.contains(&of.name))
            .map(|of| Ok(trial::read(&of.path, &signature)?.0))
            .collect()
    };
    let mut seconds = BTreeMap::new();
    let mut clock = Instant::now();
    let mut lap = |name: &str| {
        seconds.insert(name.to_owned(), clock.elapsed().as_secs_f64());
        clock = Instant::now();
    };
    let study = Study::prepare(&plant, read(&split.fit)?, settings.clone(), &watch)?;
    lap("prepare");
    let bench = study.bench(&watch)?;
    lap("sensitivities");
    let found = gap::find(&study, &bench, &split.held_out, &watch)?;
    lap("find");
    let naming = gap::name(&study, &bench, &watch)?;
    lap("name");
    let addition = gap::add(&study, &bench, &naming);
    let mut added = None;
    let mut verified = None;
    let mut patched_path = None;
    let mut sensors = BTreeMap::new();
    if let Some(addition) = addition {
        let mut record = addition.added;
        let patched = patch::patch(&patch::Request {
            nominal: &args.model,
            entries: &addition.entries,
            description: model,
            names,
            search: &[],
        })?;
        let path = args.out.join("patched.xml");
        fs::write(&path, &patched.xml)?;
        record.model = Some("patched.xml".to_owned());
        record.diff = patch::unified(
            &fs::read_to_string(&args.model)?,
            &patched.xml,
            ("nominal", "patched.xml"),
        );
        sensors.clone_from(&record.sensors);
        patched_path = Some(path);
        added = Some(record);
    }
    lap("add");
    if !split.held_out.is_empty() {
        let after = match &patched_path {
            Some(path) => MujocoPlant::load(path).context("the patched model")?,
            None => MujocoPlant::load(&args.model)?,
        };
        verified = Some(gap::verify(
            &plant,
            &after,
            &sensors,
            read(&split.held_out)?,
            &found.channels,
            &settings,
            &watch,
        )?);
    }
    lap("verify");
    seconds.insert("total".to_owned(), begin.elapsed().as_secs_f64());
    let verdict = gap::conclude(&found, &naming.named, added.as_ref(), verified.as_ref());
    let record = Record {
        model: args.model.display().to_string(),
        command: std::env::args().collect::<Vec<_>>().join(" "),
        found,
        named: naming.named,
        added,
        verified,
        verdict,
        seconds,
    };
    write(&args.out, "record.json", &record)?;
    write(&args.out, "verdict.json", &record.verdict)?;
    super::print_json(&record.verdict)?;
    Ok(())
}

fn write(out: &Path, name: &str, value: &impl serde::Serialize) -> anyhow::Result<()> {
    fs::write(out.join(name), serde_json::to_string_pretty(value)?)?;
    Ok(())
}
