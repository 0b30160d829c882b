//! `hydro compare`: the paper's experiments by one command. Every model with every solver is trained over some seeds and
//! examined, each job in a process of its own; then the tables are written.

mod args;
mod folder;
mod inputs;
mod job;
mod plan;
mod scheduler;
#[cfg(mujoco_plugins)]
mod swimming;
mod tables;

use anyhow::{Context as _, bail};
use hydro_files::FolderLock;

pub(super) use self::args::Args;
use self::{folder::Folder, inputs::Inputs, plan::Plan};
use super::{command_line::command_line, output::print_json};

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let inputs = Inputs::open(args)?;
    let plan = Plan::new(args, &inputs)?;
    let folder = Folder::new(&args.out);
    if let Some(job) = &args.only {
        if !plan.jobs.contains(job) {
            bail!(
                "--only {job}: no such job; there are {}",
                plan.jobs
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join(", ")
            );
        }
        return job::run(args, &inputs, &plan, &folder, job);
    }
    if args.list {
        return list(args, &inputs, &plan, &folder);
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("--out {}", args.out.display()))?;
    let _lock = FolderLock::take(&args.out.join(".lock"), &command_line())
        .with_context(|| format!("--out {}: wait, or choose another", args.out.display()))?;
    folder.remove_abandoned(&plan.jobs);
    let failed = if args.tables {
        Vec::new()
    } else {
        scheduler::run(args, &inputs, &plan, &folder)?
    };
    tables::write(args, &inputs, &plan, &folder)?;
    if !failed.is_empty() {
        bail!(
            "{} of {} jobs failed: {}",
            failed.len(),
            plan.jobs.len(),
            listed(&failed)
        );
    }
    Ok(())
}

/// Messages of failed jobs that the last message holds; each was shown when its job failed.
const SHOWN: usize = 3;
/// Characters of each.
const LONGEST: usize = 600;

/// The first messages, and how many more there are.
fn listed(failed: &[String]) -> String {
    let shown = failed.iter().take(SHOWN);
    let shown = shown.map(|message| hydro_files::one_line(message, LONGEST));
    let shown = shown.collect::<Vec<_>>().join("; ");
    match failed.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown}; and {more} more"),
    }
}

/// One line a job.
fn list(args: &Args, inputs: &Inputs, plan: &Plan, folder: &Folder) -> anyhow::Result<()> {
    let mut found = Vec::new();
    for job in &plan.jobs {
        found.push((job.to_string(), folder.done(job, plan, inputs)?.is_some()));
    }
    if args.json {
        let jobs: Vec<_> = found
            .iter()
            .map(|(job, done)| serde_json::json!({"job": job, "done": done}))
            .collect();
        return print_json(&jobs);
    }
    for (job, done) in found {
        say!("{job}{}", if done { "  done" } else { "" });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{LONGEST, listed};

    #[test]
    fn three_failed_jobs_are_told_and_the_others_counted() {
        let failed = ["a", "b", "c", "d", "e"].map(str::to_owned);
        assert_eq!(listed(&failed[..3]), "a; b; c");
        assert_eq!(listed(&failed), "a; b; c; and 2 more");
        assert!(listed(&["y".repeat(100_000)]).len() < LONGEST + 100);
    }
}
