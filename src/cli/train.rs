//! `hydro train`: a data set in, a checkpoint out. A run interrupted at any time resumes where it stopped.

use std::{
    ffi::{OsStr, OsString},
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use hydro_files::FolderLock;
use hydro_model::{Adjoint, Outputs, Solver, checkpoint::Checkpoint, kinematics::Kinematics};
use hydro_training::{
    Evaluation, InitialForce, LogRecord, Observer, TrainConfig, TrainDevice, TrainOutcome,
    TrainProgress, Trainer, dataset::Dataset, evaluate,
};

use super::{
    cancel::cancel_on_signal,
    command_line::command_line,
    model_flags::{ModelFlags, Preset},
    output::print_json,
    progress::Progress,
};

/// Flags of `hydro train`. A flag that is left out takes the preset's value.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit status: 0 trained; 3 the loss is no longer a number (lower the learning rate or the horizon); \
                  2 a flag that cannot be parsed; 1 any other failure, also an interruption."
)]
pub(super) struct Args {
    /// Data set (scripts/gen_task2.py).
    #[arg(long)]
    data: PathBuf,
    /// Folder of the checkpoint to write.
    #[arg(long)]
    out: PathBuf,
    /// Name in the card; the folder's name if left out.
    #[arg(long)]
    name: Option<String>,
    #[command(flatten)]
    model: ModelFlags,
    /// wrench, on the base; or generalised, the torques of the water on the joints too, where the data set has them
    /// (gen_task2.py --water strip).
    #[arg(long, default_value_t)]
    outputs: Outputs,
    /// Sizes and length of training to start from.
    #[arg(long, value_enum, default_value_t = Preset::Full)]
    preset: Preset,
    /// euler, rk4 or dopri5, for models that a solver steps; a cnode and graphics cards have euler and rk4 alone.
    #[arg(long)]
    solver: Option<Solver>,
    /// Gradient to follow: discrete, of the solver's steps; or continuous, of the differential equation. The distance
    /// of the latter from the former is shown every epoch.
    #[arg(long)]
    adjoint: Option<Adjoint>,
    /// Passes over the training split.
    #[arg(long)]
    epochs: Option<usize>,
    /// Windows a step.
    #[arg(long)]
    batch: Option<usize>,
    /// Samples a window.
    #[arg(long)]
    horizon: Option<usize>,
    /// Largest learning rate.
    #[arg(long)]
    learning_rate: Option<f64>,
    /// Epochs without progress on the validation split before stopping.
    #[arg(long)]
    patience: Option<usize>,
    /// Train on the first so many trajectories.
    #[arg(long)]
    trajectories: Option<usize>,
    /// Seed of the first weights and of the order of the data.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// cpu, cuda or cuda:N; a graphics card needs a build with `--features cuda`.
    #[arg(long, default_value_t)]
    device: TrainDevice,
    /// Continue the run in --out, interrupted or finished.
    #[arg(long, conflicts_with = "overwrite")]
    resume: bool,
    /// Replace the run in --out.
    #[arg(long)]
    overwrite: bool,
    /// Print one JSON value at the end and nothing else on standard output.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let data = Dataset::open(&args.data)?.with_outputs(args.outputs)?;
    let config = configuration(args, data.manifest().kinematics.as_ref())?;
    let mut trainer = Trainer::on(args.device, config, &data)?;
    let folder = RunFolder::new(&args.out)?;
    if args.resume && folder.finished() {
        let card = Checkpoint::load(&args.out)?.card;
        trainer.check_card(&card)?;
        return report(args, "trained already", &card.metrics);
    }
    let _lock = folder.lock()?;
    hydro_files::remove_abandoned(&folder.run);
    folder.prepare(args)?;
    if args.resume && trainer.resume(&folder.run)? {
        let other = trainer.resumed_from().filter(|from| *from != args.device);
        let note = other.map_or(String::new(), |from| {
            format!(
                "; so far on {from}, now on {}: the same within rounding, not to the bit",
                args.device
            )
        });
        eprintln!("going on after {} epochs{note}", trainer.log().len());
    }
    eprintln!(
        "{}: {} parameters, {} steps at most, on {}",
        args.out.display(),
        trainer.parameter_count(),
        trainer.steps(),
        args.device
    );
    if !trainer.validates() {
        eprintln!(
            "the val split of {} is empty: every epoch is trained, and the last one's weights are kept",
            args.data.display()
        );
    }
    let cancel = cancel_on_signal(
        "the same command with --resume goes on from the last epoch that was saved",
    )?;
    let mut observer = Watch {
        progress: Progress::new("training", trainer.steps() as u64),
        best: None,
    };
    let outcome = (trainer.run(&folder.run, &cancel, &mut observer))
        .with_context(|| format!("training in {}", folder.run.display()))?;
    observer.progress.finish();
    if outcome == TrainOutcome::Cancelled {
        bail!(
            "interrupted; the same command with --resume goes on from {}",
            folder.run.display()
        );
    }
    let name = match &args.name {
        Some(name) => name.clone(),
        None => folder.name(),
    };
    let mut checkpoint = trainer.checkpoint(&name, &command_line())?;
    // Hours of training are not lost for want of data to test on.
    let tested = data.split("test", None).map_err(Into::into);
    let tested = tested.and_then(|test| evaluate(&checkpoint, &test, InitialForce::Clean));
    if let Ok(evaluation) = &tested {
        checkpoint.card.metrics = serde_json::to_value(evaluation)?;
    }
    checkpoint.save(&args.out)?;
    if let Err(error) = tested {
        eprintln!(
            "{}: saved without errors on the test split of {}: {error}",
            args.out.display(),
            args.data.display()
        );
    }
    let words = format!("trained for {} epochs", trainer.log().len());
    report(args, &words, &checkpoint.card.metrics)
}

/// Prints the errors on the test split.
fn report(args: &Args, words: &str, metrics: &serde_json::Value) -> anyhow::Result<()> {
    if args.json {
        return print_json(
            &serde_json::json!({"checkpoint": args.out.display().to_string(), "test": metrics}),
        );
    }
    if metrics.is_null() {
        say!("{}: {words}; not tested", args.out.display());
        return Ok(());
    }
    let figure = |name: &str| metrics[name].as_f64().unwrap_or(f64::NAN);
    say!(
        "{}: {words}; test split: normalised RMSE {:.4}, without buoyancy {:.4}",
        args.out.display(),
        figure("pooled"),
        figure("pooled_hydrodynamic")
    );
    Ok(())
}

/// The preset's settings with the flags on top.
fn configuration(args: &Args, kinematics: Option<&Kinematics>) -> anyhow::Result<TrainConfig> {
    let mut config = match args.preset {
        Preset::Full => TrainConfig::default(),
        Preset::Release => TrainConfig {
            epochs: 40,
            learning_rate: 2e-3,
            ..TrainConfig::default()
        },
        Preset::Demo => TrainConfig {
            epochs: 25,
            ..TrainConfig::default()
        },
    };
    config.model = args.model.config(args.preset, kinematics)?;
    config.solver = args.solver.unwrap_or_else(|| args.model.usual_solver());
    config.seed = args.seed;
    config.outputs = args.outputs;
    config.trajectories = args.trajectories;
    let set = |target: &mut usize, flag: Option<usize>| {
        if let Some(value) = flag {
            *target = value;
        }
    };
    set(&mut config.epochs, args.epochs);
    set(&mut config.batch, args.batch);
    set(&mut config.horizon, args.horizon);
    set(&mut config.patience, args.patience);
    if let Some(rate) = args.learning_rate {
        config.learning_rate = rate;
    }
    if let Some(adjoint) = args.adjoint {
        config.adjoint = adjoint;
    }
    Ok(config)
}

/// The checkpoint's folder, and the folder beside it where the run keeps its state and log.
struct RunFolder {
    out: PathBuf,
    run: PathBuf,
}

/// Parts of a name one after the other; they need not be UTF-8.
fn joined(parts: &[&OsStr]) -> OsString {
    parts.iter().copied().collect()
}

impl RunFolder {
    fn new(out: &Path) -> anyhow::Result<Self> {
        let Some(name) = out.file_name() else {
            bail!("--out {}: expected the name of a folder", out.display());
        };
        Ok(Self {
            out: out.to_owned(),
            run: out.with_file_name(joined(&[name, ".run".as_ref()])),
        })
    }

    fn name(&self) -> String {
        let name = self.out.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Keeps other processes from the two folders; the file of the lock stands beside them.
    fn lock(&self) -> anyhow::Result<FolderLock> {
        let name = self.out.file_name().unwrap_or_default();
        let path = (self.out).with_file_name(joined(&[".".as_ref(), name, ".lock".as_ref()]));
        if let Some(parent) = path.parent().filter(|it| !it.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent)
                .with_context(|| format!("--out {}", self.out.display()))?;
        }
        FolderLock::take(&path, &command_line())
            .with_context(|| format!("--out {}: wait, or choose another", self.out.display()))
    }

    fn finished(&self) -> bool {
        self.out.join("card.json").is_file()
    }

    /// Refuses a folder that is in use. `--overwrite` clears the run's own folder; the old checkpoint stays until
    /// the new one replaces it, and a folder that is no checkpoint is left alone.
    fn prepare(&self, args: &Args) -> anyhow::Result<()> {
        let is_empty = |path: &Path| {
            path.read_dir()
                .is_ok_and(|mut found| found.next().is_none())
        };
        if self.out.exists() && !self.finished() && !is_empty(&self.out) {
            bail!(
                "--out {}: holds something that is no checkpoint (no card.json); choose another folder",
                self.out.display()
            );
        }
        let there = [&self.out, &self.run]
            .into_iter()
            .find(|path| path.exists());
        if args.overwrite && self.run.exists() {
            std::fs::remove_dir_all(&self.run)
                .with_context(|| format!("removing {}", self.run.display()))?;
        } else if !args.resume
            && !args.overwrite
            && let Some(path) = there
        {
            bail!(
                "{} is there already: --resume goes on with it, --overwrite starts anew",
                path.display()
            );
        }
        Ok(())
    }
}

/// Shows the progress of the run.
struct Watch {
    progress: Progress,
    best: Option<f64>,
}

impl Observer for Watch {
    fn step(&mut self, now: &TrainProgress) {
        let best = self
            .best
            .map_or(String::new(), |best| format!(", best validation {best:.4}"));
        let words = format!(
            "epoch {}/{}, loss {:.5}{best}",
            now.epoch + 1,
            now.epochs,
            now.loss
        );
        self.progress.at(now.step as u64, &words);
    }

    fn epoch(&mut self, record: &LogRecord, _: Option<&Evaluation>) {
        self.best = record.best;
        if let Some(error) = record.adjoint_error {
            self.progress.say(&format!(
                "epoch {}: the continuous adjoint's gradient is {:.2} % off that of the steps as taken",
                record.epoch,
                100.0 * error
            ));
        }
    }
}
