//! `hydro simulate`: drive a robot under a learned wrench, beside the truth and baselines.

use std::{
    convert::Infallible,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use hydro_frames::to_world;
use hydro_model::{
    EngineKind, Outputs,
    checkpoint::Checkpoint,
    document::Difference,
    features::{Feature, FeatureLayout},
};
use hydro_plugin::{
    mujoco::simulator::Swimmer,
    report::page::{Video, render},
};
use hydro_training::{
    InitialForce,
    comparison::{
        BOUND, LongRun, LongRunPeaks, Method, ORACLE, OpenLoop, Predict, Summary, closed_loop,
        long_run_peaks, open_loop, precomputed, step_times,
    },
    dataset::{Dataset, Split},
    drag::{Drag, drag_predictions},
    metrics::predict_by_engine,
    rollouts::Rollouts,
};

use super::{
    command_line::command_line,
    files::write_whole,
    other_water::other_water,
    output::print_json,
    progress::Progress,
    references::{BASELINES, BOX_FLUID, Scenes, buoyant_model, fitted_drags, reference_methods},
    sample_period::check_sample_period,
    swim::{HORIZONS, in_plugin},
    table::table,
    yardsticks::without_learning,
};

/// Flags of `hydro simulate`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Checkpoint that drives the robot.
    #[arg(long, default_value = "models/b1-task2")]
    checkpoint: PathBuf,
    /// Recorded rollouts of the truth (scripts/record_rollouts.py).
    #[arg(long)]
    rollouts: PathBuf,
    /// Checkpoint of a memoryless MLP, to stand beside it.
    #[arg(long)]
    mlp: Option<PathBuf>,
    /// Data set: the drag baseline is fitted on its training split, open-loop errors are of its test split.
    #[arg(long)]
    data: Option<PathBuf>,
    /// A folder with one long rollout: are speeds, rates and wrench bounded?
    #[arg(long)]
    long: Option<PathBuf>,
    /// Folder of the scenes b1_swim.xml, b1_box_fluid.xml, b1.xml, and of the one that the rollouts were recorded in.
    #[arg(long, default_value = "mjcf")]
    scenes: PathBuf,
    /// The plugin's engine for the network: fused, fused-f16, fused-i16 or candle.
    #[arg(long, default_value_t = EngineKind::Fused)]
    engine: EngineKind,
    /// Outputs of the checkpoint that act: wrench, on the base alone, or generalised, on the joints too [default: all that it
    /// has].
    #[arg(long)]
    outputs: Option<Outputs>,
    /// Write the page with plots here (HTML, self-contained).
    #[arg(long)]
    report: Option<PathBuf>,
    /// Video to embed in the page (.mp4 or .webm).
    #[arg(long, requires = "report")]
    video: Option<PathBuf>,
    /// Print one JSON value and nothing else.
    #[arg(long)]
    json: bool,
}

/// A data set, its test split and the drag fitted on it.
struct Data {
    dataset: Dataset,
    test: Split,
    /// Drag laws fitted on the training split, by name.
    drags: Vec<(&'static str, Drag)>,
}

/// Inputs of all methods, checked before any work starts.
struct Setup {
    subject: String,
    checkpoint: Checkpoint,
    mlp: Option<Checkpoint>,
    rollouts: Rollouts,
    data: Option<Data>,
    /// The warning of another water.
    other_water: Option<String>,
    /// Text of the scene that the plugin stands in.
    swim: String,
    scenes: Scenes,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let setup = read(args)?;
    let video = args.video.as_deref().map(read_video).transpose()?;
    let methods = methods(args, &setup)?;

    let total = methods.len() * setup.rollouts.runs.len();
    let progress = Progress::new("closed loop", total as u64);
    let closed = closed_loop(&methods, &setup.rollouts.runs, &HORIZONS, &|name| {
        progress.tick(name)
    })?;
    progress.finish();
    let step_times = step_times(&methods, &setup.rollouts.runs[0])?;
    let open = match &setup.data {
        Some(data) => Some(open(&setup, data, args.engine)?),
        None => None,
    };
    let long = match &args.long {
        Some(folder) => Some(long_run(&setup, folder, &methods)?),
        None => None,
    };

    let summary = Summary {
        subject: setup.subject.clone(),
        open_loop: open,
        closed_loop: closed,
        long,
        step_times,
        provenance: provenance(&setup),
    };
    if let Some(path) = &args.report {
        write_whole(path, render(&summary, video.as_ref()).as_bytes())?;
    }
    if args.json {
        return print_json(&summary);
    }
    show(&summary)?;
    if let Some(path) = &args.report {
        say!("report: {}", path.display());
    }
    Ok(())
}

fn read(args: &Args) -> anyhow::Result<Setup> {
    let checkpoint = Checkpoint::load(&args.checkpoint)?;
    let mlp = args.mlp.as_deref().map(Checkpoint::load).transpose()?;
    let rollouts = Rollouts::load(&args.rollouts)?;
    if rollouts.runs.is_empty() {
        bail!("{}: holds no rollout", args.rollouts.display());
    }
    let card = &checkpoint.card;
    let (found, expected) = (rollouts.index.features.features(), card.features.features());
    if let Some(difference) = Difference::find("feature", found, expected) {
        bail!(
            "{}: {difference} as in {}: the rollouts are of another robot",
            args.rollouts.display(),
            args.checkpoint.display()
        );
    }
    if let (Some(mlp), Some(folder)) = (&mlp, &args.mlp)
        && let Some(difference) = Difference::find("output", &mlp.card.outputs, &card.outputs)
    {
        bail!(
            "--mlp {}: {difference} as in {}",
            folder.display(),
            args.checkpoint.display()
        );
    }
    if args.outputs == Some(Outputs::Generalised)
        && Outputs::of(&card.outputs) != Outputs::Generalised
    {
        bail!(
            "--outputs generalised: {} gives the wrench on the base alone ({}); train one with `hydro train --outputs \
             generalised`",
            args.checkpoint.display(),
            card.outputs.join(", ")
        );
    }
    let other_water = other_water(
        (&args.checkpoint, card.water.as_ref()),
        (&args.rollouts, rollouts.index.water.as_ref()),
    );
    if let Some(warning) = &other_water {
        eprintln!("{warning}");
    }
    let swim = args.scenes.join("b1_swim.xml");
    let swim = hydro_files::read_text(&swim, hydro_files::TEXT)
        .with_context(|| format!("scene {}", swim.display()))?;
    let scenes = Scenes::find(&args.scenes, &rollouts)?;
    let data = args
        .data
        .as_deref()
        .map(|folder| read_data(folder, &checkpoint, &args.checkpoint))
        .transpose()?;
    Ok(Setup {
        subject: card.model.kind().to_owned(),
        other_water,
        checkpoint,
        mlp,
        rollouts,
        data,
        swim,
        scenes,
    })
}

/// The test split, and the drag laws fitted on the training split.
fn read_data(folder: &Path, checkpoint: &Checkpoint, from: &Path) -> anyhow::Result<Data> {
    let dataset = Dataset::open(folder)?;
    let found = dataset.manifest().features.features();
    let expected = checkpoint.card.features.features();
    if let Some(difference) = Difference::find("feature", found, expected) {
        bail!(
            "--data {}: {difference} as in {}",
            folder.display(),
            from.display()
        );
    }
    check_sample_period(
        (from, checkpoint.card.sample_period),
        (folder, dataset.manifest().sample_period),
    )?;
    let water = dataset.manifest().water.as_ref();
    if let Some(warning) = other_water((from, checkpoint.card.water.as_ref()), (folder, water)) {
        eprintln!("{warning}");
    }
    let drags = fitted_drags(&dataset)?;
    let dataset = dataset.with_outputs(Outputs::of(&checkpoint.card.outputs))?;
    Ok(Data {
        test: dataset.split("test", None)?,
        drags,
        dataset,
    })
}

fn methods<'a>(args: &'a Args, setup: &'a Setup) -> anyhow::Result<Vec<Method<'a, anyhow::Error>>> {
    let mut all = vec![in_plugin(
        &setup.subject,
        &args.checkpoint,
        args.engine,
        args.outputs,
        &setup.swim,
    )?];
    if let (Some(folder), Some(mlp)) = (&args.mlp, &setup.mlp) {
        all.push(in_plugin(
            &format!("memoryless {}", mlp.card.model.kind()),
            folder,
            args.engine,
            None,
            &setup.swim,
        )?);
    }
    let drags = setup.data.as_ref().map_or(&[][..], |data| &data.drags);
    all.extend(reference_methods(&setup.scenes, drags));
    Ok(all)
}

/// Open-loop errors on the test split, from the true force at the start as in the paper.
fn open(setup: &Setup, data: &Data, engine: EngineKind) -> anyhow::Result<OpenLoop> {
    let (manifest, test) = (data.dataset.manifest(), &data.test);
    let layout = &manifest.features;
    let learned =
        |checkpoint: &Checkpoint, start| -> anyhow::Result<Box<Predict<'_, Infallible>>> {
            let place = || format!("the checkpoint {}", checkpoint.card.name);
            let engine = checkpoint.engine(engine, None).with_context(place)?;
            let forces = predict_by_engine(engine.as_ref(), test, start).with_context(place)?;
            Ok(precomputed(forces))
        };
    let mut rows: Vec<(String, Box<Predict<'_, Infallible>>)> = vec![(
        setup.subject.clone(),
        learned(&setup.checkpoint, InitialForce::Clean)?,
    )];
    rows.push((
        format!("{}, estimated start", setup.subject),
        learned(&setup.checkpoint, InitialForce::Estimate)?,
    ));
    if let Some(mlp) = &setup.mlp {
        rows.push((
            format!("memoryless {}", mlp.card.model.kind()),
            learned(mlp, InitialForce::Estimate)?,
        ));
    }
    // The baselines know a wrench, and no torques of joints.
    if Outputs::of(&manifest.outputs) == Outputs::Wrench {
        for (name, drag) in &data.drags {
            rows.push(((*name).to_owned(), drag_predictions(drag, layout)));
        }
        rows.push((
            BOX_FLUID.to_owned(),
            precomputed(box_fluid(&setup.scenes.box_fluid, layout, test)?),
        ));
    }
    rows.extend(without_learning(test));
    let progress = Progress::new("open loop", rows.len() as u64);
    let Ok(result) = open_loop(&rows, test, &manifest.outputs, 0, &|name| {
        progress.tick(name)
    });
    progress.finish();
    Ok(result)
}

/// MuJoCo's inertia-box fluid with exact buoyancy at every recorded state: `[M][T * 6]`.
fn box_fluid(scene: &Path, layout: &FeatureLayout, test: &Split) -> anyhow::Result<Vec<Vec<f64>>> {
    let map =
        StateMap::new(layout).context("the features do not hold the state of a floating robot")?;
    let mut trajectories = Vec::new();
    let mut swimmer: Option<(f64, Swimmer)> = None;
    for trajectory in 0..test.len() {
        let mut wrenches = Vec::with_capacity(test.samples() * 6);
        for sample in test.x(trajectory).chunks_exact(test.inputs()) {
            let density = f64::from(sample[map.density]);
            let known = swimmer.take().filter(|(at, _)| *at == density);
            let (at, mut robot) = match known {
                Some(known) => known,
                None => (density, Swimmer::new(buoyant_model(scene, density, true)?)?),
            };
            let (qpos, qvel) = map.state(sample);
            wrenches.extend(robot.passive_wrench_at(&qpos, &qvel).to_array());
            swimmer = Some((at, robot));
        }
        trajectories.push(wrenches);
    }
    Ok(trajectories)
}

/// Columns of a floating robot's state among its features.
struct StateMap {
    positions: Vec<usize>,
    velocities: Vec<usize>,
    quaternion: usize,
    angular: usize,
    linear: usize,
    density: usize,
}

impl StateMap {
    fn new(layout: &FeatureLayout) -> Option<Self> {
        let joints = layout.joints();
        let at = |feature: &dyn Fn(String) -> Feature| -> Option<Vec<usize>> {
            joints
                .iter()
                .map(|joint| layout.index_of(&feature(joint.clone())))
                .collect()
        };
        Some(Self {
            positions: at(&Feature::JointPosition)?,
            velocities: at(&Feature::JointVelocity)?,
            quaternion: layout.quaternion()?,
            angular: layout.index_of(&Feature::AngularVelocity(0))?,
            linear: layout.index_of(&Feature::LinearVelocity(0))?,
            density: layout.density()?,
        })
    }

    /// qpos (at the origin) and qvel of a sample.
    fn state(&self, sample: &[f32]) -> (Vec<f64>, Vec<f64>) {
        let value = |at: usize| f64::from(sample[at]);
        let three = |at: usize| [value(at), value(at + 1), value(at + 2)];
        let q = self.quaternion;
        let attitude = [value(q), value(q + 1), value(q + 2), value(q + 3)];
        let mut qpos = vec![0.0; 3];
        qpos.extend(attitude);
        qpos.extend(self.positions.iter().map(|at| value(*at)));
        let mut qvel = to_world(attitude, three(self.linear)).to_vec();
        qvel.extend(three(self.angular));
        qvel.extend(self.velocities.iter().map(|at| value(*at)));
        (qpos, qvel)
    }
}

/// The subject and the oracle through the long run.
fn long_run(
    setup: &Setup,
    folder: &Path,
    methods: &[Method<'_, anyhow::Error>],
) -> anyhow::Result<LongRun> {
    let rollouts = Rollouts::load(folder)?;
    let run = rollouts
        .runs
        .first()
        .with_context(|| format!("{}: holds no rollout", folder.display()))?;
    let progress = Progress::new("long run", 2);
    let peaks = |name: &str| -> anyhow::Result<LongRunPeaks> {
        let method = methods
            .iter()
            .find(|method| method.name == name)
            .with_context(|| format!("no method {name}"))?;
        let mut simulator = (method.simulator)(run)?;
        let found = long_run_peaks(simulator.as_mut(), &method.water, run);
        progress.tick(name);
        Ok(found)
    };
    let has_oracle = methods.iter().any(|method| method.name == ORACLE);
    let long = LongRun {
        subject: peaks(&setup.subject)?,
        oracle: has_oracle.then(|| peaks(ORACLE)).transpose()?,
    };
    progress.finish();
    Ok(long)
}

fn provenance(setup: &Setup) -> Vec<(String, String)> {
    let card = &setup.checkpoint.card;
    let mut rows = vec![
        ("this page".to_owned(), command_line()),
        ("model".to_owned(), card.command.clone()),
        (
            "parameters".to_owned(),
            setup.checkpoint.parameter_count().to_string(),
        ),
    ];
    if let Some(dataset) = &card.dataset {
        rows.push((
            "trained on".to_owned(),
            format!(
                "{}, {} trajectories, manifest sha256 {}",
                dataset.name, dataset.trajectories, dataset.sha256
            ),
        ));
    }
    rows.push(("rollouts".to_owned(), setup.rollouts.index.command.clone()));
    if let Some(warning) = &setup.other_water {
        rows.push(("another water".to_owned(), warning.clone()));
    }
    rows
}

/// Bytes of a video at most: it stands in the page, a third longer.
const LARGEST_VIDEO: u64 = 1 << 28;

fn read_video(path: &Path) -> anyhow::Result<Video> {
    let mime = match path.extension().and_then(|ending| ending.to_str()) {
        Some("mp4") => "video/mp4",
        Some("webm") => "video/webm",
        _ => bail!(
            "--video {}: expected a name ending in .mp4 or .webm",
            path.display()
        ),
    };
    let bytes = hydro_files::read(path, LARGEST_VIDEO)
        .with_context(|| format!("--video {}", path.display()))?;
    Ok(Video { mime, bytes })
}

/// Prints the tables for people.
fn show(summary: &Summary) -> anyhow::Result<()> {
    if let Some(open) = &summary.open_loop {
        say!(
            "Open loop, {} test trajectories, errors against the clean wrench",
            open.trajectories
        );
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let head = [
            "",
            "MAE force [N]",
            "MAE torque [N m]",
            "RMSE force [N]",
            "RMSE torque [N m]",
            "nRMSE",
            "no buoyancy",
        ];
        let rows: Vec<Vec<String>> = open
            .rows
            .iter()
            .map(|row| {
                let (force, torque) = (3.min(row.errors.mae.len()), row.errors.mae.len());
                vec![
                    row.name.clone(),
                    format!("{:.2}", mean(&row.errors.mae[..force])),
                    format!("{:.2}", mean(&row.errors.mae[force..torque])),
                    format!("{:.2}", mean(&row.errors.rmse[..force])),
                    format!("{:.2}", mean(&row.errors.rmse[force..torque])),
                    format!("{:.3}", row.errors.pooled),
                    format!("{:.3}", row.errors.pooled_hydrodynamic),
                ]
            })
            .collect();
        say!("{}", table(&head, &rows));
    }
    let closed = &summary.closed_loop;
    say!(
        "\nClosed loop, {} runs, median distance from the truth",
        closed.runs
    );
    let mut head = vec![String::new()];
    head.extend(closed.horizons.iter().map(|h| format!("{h} s [m]")));
    head.extend(closed.horizons.iter().map(|h| format!("{h} s [deg]")));
    head.extend(
        closed
            .horizons
            .iter()
            .map(|h| format!("joints {h} s [deg]")),
    );
    head.extend(["diverged".to_owned(), "step [us]".to_owned()]);
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let rows: Vec<Vec<String>> = closed
        .rows
        .iter()
        .map(|row| {
            let mut cells = vec![row.name.clone()];
            cells.extend(row.position.iter().map(|s| format!("{:.3}", s.median)));
            cells.extend(row.attitude.iter().map(|s| format!("{:.1}", s.median)));
            cells.extend(row.joints.iter().map(|s| format!("{:.2}", s.median)));
            cells.push(row.diverged.to_string());
            let time = summary.step_times.iter().find(|time| time.name == row.name);
            cells.push(time.map_or(String::new(), |time| format!("{:.1}", time.microseconds)));
            cells
        })
        .collect();
    say!("{}", table(&head, &rows));
    if closed.horizons.is_empty() {
        say!(
            "No run lasts {} s, the first time at which a distance is read.",
            HORIZONS[0]
        );
    }
    let standing = summary.standing(&BASELINES, 2.0);
    let verdict = match (&standing.compared[..], &standing.not_beaten[..]) {
        ([], _) => {
            "no baseline to compare with: no `--data` was given, and no run lasts 2 s".to_owned()
        }
        (compared, []) => format!(
            "better than {}, in {}",
            standing.baselines.join(", "),
            compared.join(", ")
        ),
        (_, ahead) => format!("NOT better than {}", ahead.join(", ")),
    };
    say!("\n{}: {verdict}", summary.subject);
    if let Some(long) = &summary.long {
        let peaks = |bounds: &LongRunPeaks| {
            let [speed, rate, force, torque] = bounds.peaks().map(|peak| peak.ratio());
            format!("speed {speed:.2}, rate {rate:.2}, force {force:.2}, torque {torque:.2}")
        };
        let verdict = if long.within(BOUND) {
            "bounded"
        } else {
            "NOT bounded"
        };
        let oracle = long.oracle.as_ref().map_or(String::new(), |oracle| {
            format!("; with the true wrench: {}", peaks(oracle))
        });
        say!(
            "\n{:.0} minutes under {}: {verdict}; maxima relative to the truth's: {}{oracle} (bounded: at most {BOUND} times the \
             truth's or the true wrench's)",
            long.subject.duration / 60.0,
            summary.subject,
            peaks(&long.subject),
        );
    }
    Ok(())
}
