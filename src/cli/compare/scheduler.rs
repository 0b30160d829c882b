//! Runs the jobs that are not done, several at a time, each in a process of its own.

use std::{
    collections::VecDeque,
    io::{BufRead as _, BufReader},
    os::unix::process::CommandExt as _,
    process::{Command, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use anyhow::{Context as _, bail};
use hydro_training::experiment::JobId;
use rustix::process::{Pid, Signal, kill_process};

use super::{args::Args, folder::Folder, inputs::Inputs, plan::Plan};
use crate::cli::{
    cancel::{GOES_ON, cancel_on_signal},
    progress::Progress,
};

/// Runs the jobs; returns an error message a failed job. The others are done all the same.
pub(super) fn run(
    args: &Args,
    inputs: &Inputs,
    plan: &Plan,
    folder: &Folder,
) -> anyhow::Result<Vec<String>> {
    let mut waiting = Vec::new();
    for job in &plan.jobs {
        if folder.done(job, plan, inputs)?.is_none() {
            waiting.push(job.clone());
        }
    }
    if waiting.is_empty() {
        eprintln!("{0} jobs, {0} done already", plan.jobs.len());
        return Ok(Vec::new());
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let places = args.parallel.map_or(cores, usize::from).min(waiting.len());
    let threads = (cores / places).max(1);
    let done = plan.jobs.len() - waiting.len();
    let begun = waiting.iter().filter(|job| folder.begun(job)).count();
    eprintln!(
        "{} jobs, {done} done already, {begun} begun; {places} at a time with {threads} threads each",
        plan.jobs.len()
    );
    let cancel = cancel_on_signal(GOES_ON)?;
    let progress = Progress::new("jobs", plan.jobs.len() as u64);
    let (finished, failed) = (AtomicU64::new(done as u64), Mutex::new(Vec::new()));
    waiting.reverse();
    let waiting = Mutex::new(waiting);
    let next = || waiting.lock().ok()?.pop();
    let (running, over) = (Running::default(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| running.watch(&cancel, &over));
        let worker = || {
            scope.spawn(|| {
                while !cancel.load(Ordering::Relaxed) {
                    let Some(job) = next() else { break };
                    let words = |line: &str| {
                        progress.at(finished.load(Ordering::Relaxed), line);
                    };
                    match child(args, &job, threads, &running, &words) {
                        Ok(()) => {
                            finished.fetch_add(1, Ordering::Relaxed);
                            words(&format!("{job} done"));
                        }
                        Err(error) => {
                            if !cancel.load(Ordering::Relaxed) {
                                progress.say(&format!("{error:#}"));
                            }
                            if let Ok(mut failed) = failed.lock() {
                                failed.push(format!("{error:#}"));
                            }
                        }
                    }
                }
            })
        };
        let workers: Vec<_> = (0..places).map(|_| worker()).collect();
        for worker in workers {
            // One that panicked is raised again where the scope ends.
            let _ = worker.join();
        }
        over.store(true, Ordering::Relaxed);
    });
    progress.finish();
    if cancel.load(Ordering::Relaxed) {
        bail!("interrupted; the same command goes on where it was");
    }
    Ok(failed.into_inner().unwrap_or_default())
}

/// Last lines of a failed job's output that its message holds.
const LAST_LINES: usize = 2;

/// Processes of the jobs under way.
#[derive(Default)]
struct Running(Mutex<Vec<Pid>>);

/// Period at which the stop flag is read.
const LOOK: Duration = Duration::from_millis(50);

impl Running {
    /// Passes a signal on to the jobs, once, until all are over. A second one would end them before they have saved
    /// their state.
    fn watch(&self, cancel: &AtomicBool, over: &AtomicBool) {
        while !over.load(Ordering::Relaxed) {
            if cancel.load(Ordering::Relaxed) {
                for job in self.0.lock().iter_mut().flat_map(|jobs| jobs.drain(..)) {
                    // It may have ended by itself.
                    let _ = kill_process(job, Signal::INT);
                }
            }
            std::thread::sleep(LOOK);
        }
    }

    fn add(&self, job: Option<Pid>) {
        if let Ok(mut jobs) = self.0.lock() {
            jobs.extend(job);
        }
    }

    /// Forgets a job that has ended, before the system gives its number to another process.
    fn remove(&self, job: Option<Pid>) {
        if let Ok(mut jobs) = self.0.lock() {
            jobs.retain(|known| Some(*known) != job);
        }
    }
}

/// Runs one job in a process and a process group of its own, so that a terminal's Ctrl-C reaches it through
/// [`Running`] alone. `words` is called with each line it prints.
fn child(
    args: &Args,
    job: &JobId,
    threads: usize,
    running: &Running,
    words: &dyn Fn(&str),
) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("finding this program")?;
    let mut command = Command::new(program);
    command.arg("compare").arg(args.experiment.to_string());
    command
        .arg("--data")
        .arg(&args.data)
        .arg("--out")
        .arg(&args.out);
    for (flag, path) in [("--rollouts", &args.rollouts), ("--long", &args.long)] {
        if let Some(path) = path {
            command.arg(flag).arg(path);
        }
    }
    for beyond in &args.beyond {
        command.arg("--beyond").arg(beyond);
    }
    let seeds: Vec<String> = args.seeds().iter().map(ToString::to_string).collect();
    command.arg("--seeds").arg(seeds.join(","));
    if args.quick {
        command.arg("--quick");
    }
    for (flag, number) in [
        ("--epochs", args.epochs),
        ("--trajectories", args.trajectories),
    ] {
        if let Some(number) = number {
            command.arg(flag).arg(number.to_string());
        }
    }
    if let Some(rate) = args.learning_rate {
        command.arg("--learning-rate").arg(rate.to_string());
    }
    command.arg("--scenes").arg(&args.scenes);
    command.arg("--only").arg(job.to_string());
    command.arg("--parent").arg(std::process::id().to_string());
    command
        .env("RAYON_NUM_THREADS", threads.to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .process_group(0);
    let mut child = command.spawn().with_context(|| format!("starting {job}"))?;
    let pid = Pid::from_raw(child.id().cast_signed());
    running.add(pid);
    let mut last = VecDeque::new();
    if let Some(stderr) = child.stderr.take() {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            words(&line);
            last.push_back(hydro_files::short(line));
            if last.len() > LAST_LINES {
                last.pop_front();
            }
        }
    }
    running.remove(pid);
    let status = child.wait().with_context(|| format!("waiting for {job}"))?;
    if !status.success() {
        let last = match Vec::from(last).join(" / ") {
            none if none.is_empty() => "none".to_owned(),
            last => last,
        };
        bail!("{job} failed ({status}); its last lines: {last}");
    }
    Ok(())
}
