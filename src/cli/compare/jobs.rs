//! Runs the jobs that are not done, some at a time, each in a process of its own.

use std::{
    io::{BufRead as _, BufReader},
    process::{Command, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

use anyhow::{Context as _, anyhow, bail};
use hydro_plugin::experiment::JobId;

use super::{Args, Folder, Inputs, Plan};
use crate::cli::{cancel::cancel_on_signal, progress::Progress};

pub(super) fn run(
    args: &Args,
    inputs: &Inputs,
    plan: &Plan,
    folder: &Folder,
) -> anyhow::Result<()> {
    let mut waiting = Vec::new();
    for job in &plan.jobs {
        if folder.done(job, plan, inputs)?.is_none() {
            waiting.push(job.clone());
        }
    }
    if waiting.is_empty() {
        return Ok(());
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let places = args.parallel.map_or(cores, usize::from).min(waiting.len());
    let threads = (cores / places).max(1);
    let done = plan.jobs.len() - waiting.len();
    eprintln!(
        "{} jobs, {done} done already; {places} at a time with {threads} threads each",
        plan.jobs.len()
    );
    let cancel = cancel_on_signal()?;
    let progress = Progress::new("jobs", plan.jobs.len() as u64);
    let (finished, failed) = (AtomicU64::new(done as u64), AtomicBool::new(false));
    waiting.reverse();
    let waiting = Mutex::new(waiting);
    let next = || waiting.lock().ok()?.pop();
    let errors: Vec<anyhow::Error> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..places)
            .map(|_| {
                scope.spawn(|| {
                    while !cancel.load(Ordering::Relaxed) && !failed.load(Ordering::Relaxed) {
                        let Some(job) = next() else { break };
                        let words = |line: &str| {
                            progress.at(finished.load(Ordering::Relaxed), line);
                        };
                        child(args, &job, threads, &words).inspect_err(|_| {
                            failed.store(true, Ordering::Relaxed);
                        })?;
                        finished.fetch_add(1, Ordering::Relaxed);
                        words(&format!("{job} done"));
                    }
                    Ok(())
                })
            })
            .collect();
        workers
            .into_iter()
            .filter_map(|worker| {
                let ended = worker
                    .join()
                    .unwrap_or_else(|_| Err(anyhow!("a worker panicked")));
                ended.err()
            })
            .collect()
    });
    progress.finish();
    if cancel.load(Ordering::Relaxed) {
        bail!("interrupted; the same command goes on where it was");
    }
    errors.into_iter().next().map_or(Ok(()), Err)
}

/// One job in a process of its own; `words` hears its last line.
fn child(args: &Args, job: &JobId, threads: usize, words: &dyn Fn(&str)) -> anyhow::Result<()> {
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
    let seeds: Vec<String> = args.seeds.iter().map(ToString::to_string).collect();
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
    command.arg("--scenes").arg(&args.scenes);
    command.arg("--only").arg(job.to_string());
    command
        .env("RAYON_NUM_THREADS", threads.to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let mut child = command.spawn().with_context(|| format!("starting {job}"))?;
    let mut last = String::new();
    if let Some(stderr) = child.stderr.take() {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            words(&line);
            last = line;
        }
    }
    let status = child.wait().with_context(|| format!("waiting for {job}"))?;
    if !status.success() {
        bail!("{job} failed ({status}): {last}");
    }
    Ok(())
}
