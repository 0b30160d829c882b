//! One job: train, examine, write the result. Interrupted, it goes on where it was.

use std::{fs, time::Instant};

use anyhow::{Context as _, bail};
use hydro_model::checkpoint::Checkpoint;
use hydro_training::{
    Evaluation, LogRecord, Observer, TrainConfig, TrainOutcome, TrainProgress, Trainer,
    experiment::{JobId, JobResult, SCHEMA, TrainingNote, examine},
};

use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};

use super::{args::Args, folder::Folder, inputs::Inputs, plan::Plan};
use crate::cli::{
    cancel::{GOES_ON, cancel_on_signal},
    command_line::command_line,
    machine::peak_memory,
    progress::Progress,
};

pub(super) fn run(
    args: &Args,
    inputs: &Inputs,
    plan: &Plan,
    folder: &Folder,
    job: &JobId,
) -> anyhow::Result<()> {
    if let Some(parent) = args.parent {
        end_with(parent).with_context(|| format!("{job}: process {parent} began it"))?;
    }
    let _lock = folder.lock(job)?;
    if folder.done(job, plan, inputs)?.is_some() {
        say!("{job}: done already");
        return Ok(());
    }
    let checkpoint = trained(inputs, plan, folder, job)?;
    let training = folder
        .training(job, plan, inputs)?
        .with_context(|| format!("{job}: training.json is lost; remove its folder"))?;
    let data = &inputs.data[&job.data];
    let test = data.split("test", inputs.most_tested())?;
    let mut examination = examine(&checkpoint, &test, &inputs.read_beyond()?)?;
    #[cfg(mujoco_plugins)]
    if inputs.rollouts.is_some() {
        let swum = super::swimming::swim(args, inputs, &folder.checkpoint(job))?;
        examination.swimming = Some(swum);
    }
    #[cfg(not(mujoco_plugins))]
    let _ = args;
    // One seed's pictures are enough.
    if job.seed != plan.jobs.first().map_or(0, |first| first.seed) {
        examination.example = Vec::new();
    }
    let result = JobResult {
        schema: SCHEMA.to_owned(),
        job: job.clone(),
        data_sha256: data.sha256().to_owned(),
        examined_on: inputs.examined_on(),
        settings: plan.training(job)?,
        parameters: checkpoint.parameter_count(),
        training,
        examination,
    };
    folder.finish(&result)?;
    say!(
        "{job}: nRMSE {:.4}",
        result
            .examination
            .starts
            .get("clean")
            .map_or(f64::NAN, |errors| errors.pooled)
    );
    Ok(())
}

/// Has the system kill this process where its parent ends without it: nobody would know of it.
fn end_with(parent: i32) -> anyhow::Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    // It may have ended before.
    if Pid::as_raw(getppid()) != parent {
        bail!("it is there no more");
    }
    Ok(())
}

/// The checkpoint of a job, trained now or before.
fn trained(
    inputs: &Inputs,
    plan: &Plan,
    folder: &Folder,
    job: &JobId,
) -> anyhow::Result<Checkpoint> {
    let (settings, data) = (plan.training(job)?, &inputs.data[&job.data]);
    let before = folder.training(job, plan, inputs)?;
    let path = folder.checkpoint(job);
    if path.join("card.json").is_file() {
        // The note beside it says with what settings and on which data it was made.
        return Ok(Checkpoint::load(&path)?);
    }
    let mut trainer = Trainer::new(settings.clone(), data)?;
    if !trainer.validates() {
        bail!(
            "{job}: the val split of {} is empty: it needs a trajectory at least, for methods are compared at their best epoch; \
             make a larger data set",
            data.folder().display()
        );
    }
    let resumed = trainer.resume(&folder.run(job))?;
    let before = before.filter(|_| resumed);
    let cancel = cancel_on_signal(GOES_ON)?;
    let mut watch = Watch {
        progress: Progress::new(&job.to_string(), trainer.steps() as u64),
        folder,
        job,
        settings,
        data_sha256: data.sha256(),
        seconds: before.map_or(0.0, |note| note.seconds),
        peak: before.and_then(|note| note.peak_memory_mib),
        began: Instant::now(),
        fault: None,
    };
    let outcome = trainer.run(&folder.run(job), &cancel, &mut watch)?;
    watch.progress.finish();
    if let Some(fault) = watch.fault {
        return Err(fault);
    }
    if outcome == TrainOutcome::Cancelled {
        bail!("{job}: interrupted; the same command goes on");
    }
    let checkpoint = trainer.checkpoint(&job.to_string(), &command_line())?;
    checkpoint.save(&path)?;
    // The state of a finished training is of no more use, and several times as large as the checkpoint.
    fs::remove_dir_all(folder.run(job)).with_context(|| format!("removing the state of {job}"))?;
    Ok(Checkpoint::load(&path)?)
}

/// Shows a training, and notes after every epoch what it took.
struct Watch<'a> {
    progress: Progress,
    folder: &'a Folder,
    job: &'a JobId,
    settings: TrainConfig,
    data_sha256: &'a str,
    /// Time of interrupted runs before this one [s].
    seconds: f64,
    peak: Option<f64>,
    began: Instant,
    fault: Option<anyhow::Error>,
}

impl Observer for Watch<'_> {
    fn step(&mut self, now: &TrainProgress) {
        let words = format!(
            "epoch {}/{}, loss {:.5}",
            now.epoch + 1,
            now.epochs,
            now.loss
        );
        self.progress.at(now.step as u64, &words);
    }

    fn epoch(&mut self, record: &LogRecord, _: Option<&Evaluation>) {
        let peak = peak_memory().map(|bytes| bytes as f64 / f64::from(1 << 20));
        let note = TrainingNote {
            epochs: record.epoch + 1,
            seconds: self.seconds + self.began.elapsed().as_secs_f64(),
            threads: std::thread::available_parallelism()
                .map_or(1, Into::into)
                .min(threads()),
            peak_memory_mib: peak.into_iter().chain(self.peak).reduce(f64::max),
            validation: record.best.filter(|best| best.is_finite()),
        };
        if let Err(fault) =
            self.folder
                .note_training(self.job, &self.settings, self.data_sha256, &note)
        {
            self.fault.get_or_insert(fault);
        }
    }
}

/// Threads that products may take.
fn threads() -> usize {
    let given = std::env::var("RAYON_NUM_THREADS").ok();
    given
        .and_then(|text| text.parse().ok())
        .filter(|count| *count > 0)
        .unwrap_or(usize::MAX)
}
