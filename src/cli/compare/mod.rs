//! `hydro compare`: the paper's experiments by one command. Every model with every solver is trained over some seeds and
//! examined, each job in a process of its own; then the tables are written.

mod folder;
mod inputs;
mod job;
mod jobs;
#[cfg(mujoco_plugins)]
mod swimming;
mod tables;

use std::{collections::BTreeMap, path::PathBuf};

use anyhow::bail;
use hydro_training::experiment::{Budget, Entry, Experiment, JobId, LearningRates, entries};

use self::{folder::Folder, inputs::Inputs};
use super::print_json;

/// Flags of `hydro compare`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// task1 (towing) or task2 (swimming).
    experiment: Experiment,
    /// Data set of Task 2 (scripts/gen_task2.py), or the folder of Tasks 1.1, 1.2 and 1.3 (scripts/gen_task1.py).
    #[arg(long)]
    data: PathBuf,
    /// Folder of the jobs, the tables and the pictures.
    #[arg(long)]
    out: PathBuf,
    /// Rollouts for the closed loop (scripts/record_rollouts.py), of Task 2.
    #[arg(long)]
    rollouts: Option<PathBuf>,
    /// A folder with one long rollout: are speeds, rates and wrench bounded?
    #[arg(long, requires = "rollouts")]
    long: Option<PathBuf>,
    /// A data set outside the training range, of Task 2; may be given more than once.
    #[arg(long, value_name = "NAME=FOLDER")]
    beyond: Vec<String>,
    /// Seeds of the trainings; 0,1,2 if left out, with --quick 0,1.
    #[arg(long, value_delimiter = ',')]
    seeds: Option<Vec<u64>>,
    /// Rows of the table, as lstm,relaxation-ode; all if left out.
    #[arg(long, value_delimiter = ',')]
    entries: Option<Vec<String>>,
    /// A small part of the data, few passes, two seeds, less of everything that is asked of a model: about a quarter of an hour
    /// on two cores.
    #[arg(long)]
    quick: bool,
    /// Passes over the training split in place of the usual ones, the same for all.
    #[arg(long)]
    epochs: Option<usize>,
    /// Train on the first so many trajectories.
    #[arg(long)]
    trajectories: Option<usize>,
    /// Largest learning rate in place of each row's own, the same for all.
    #[arg(long)]
    learning_rate: Option<f64>,
    /// Jobs at a time; they share the cores. As many as there are cores if left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    parallel: Option<u16>,
    /// Do this job alone, as 2/lstm/seed-0, and write no tables.
    #[arg(long, value_name = "JOB", conflicts_with_all = ["list", "tables"])]
    only: Option<JobId>,
    /// Name the jobs, those that are done and those that are not, and do none.
    #[arg(long, conflicts_with = "tables")]
    list: bool,
    /// Write the tables of the jobs that are done, and do none.
    #[arg(long)]
    tables: bool,
    /// Take the times again, though --out has some.
    #[arg(long)]
    retime: bool,
    /// Folder of the scene b1_swim.xml.
    #[arg(long, default_value = "mjcf")]
    scenes: PathBuf,
    /// Print one JSON value at the end and nothing else on standard output.
    #[arg(long)]
    json: bool,
}

impl Args {
    fn seeds(&self) -> Vec<u64> {
        let usual = if self.quick {
            vec![0, 1]
        } else {
            vec![0, 1, 2]
        };
        self.seeds.clone().unwrap_or(usual)
    }
}

/// What is to be done, checked before any work.
struct Plan {
    entries: Vec<Entry>,
    /// By the name of the data set.
    budgets: BTreeMap<String, Budget>,
    jobs: Vec<JobId>,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let inputs = Inputs::open(args)?;
    let plan = plan(args, &inputs)?;
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
    let failed = if args.tables {
        Vec::new()
    } else {
        jobs::run(args, &inputs, &plan, &folder)?
    };
    tables::write(args, &inputs, &plan, &folder)?;
    if !failed.is_empty() {
        bail!("{} jobs failed: {}", failed.len(), failed.join("; "));
    }
    Ok(())
}

fn plan(args: &Args, inputs: &Inputs) -> anyhow::Result<Plan> {
    let mut entries = entries(inputs.outputs()?, inputs.kinematics());
    if let Some(wanted) = &args.entries {
        let known: Vec<&str> = entries.iter().map(|entry| entry.id).collect();
        if let Some(unknown) = wanted.iter().find(|id| !known.contains(&id.as_str())) {
            bail!(
                "--entries: unknown `{unknown}`; there are {}",
                known.join(", ")
            );
        }
        entries.retain(|entry| wanted.iter().any(|id| id == entry.id));
    }
    if let Some(rate) = args.learning_rate {
        for entry in &mut entries {
            entry.learning_rates = LearningRates::same(rate);
        }
    }
    let budget = |data: &str| {
        let mut budget = if args.quick {
            Budget::quick(data)
        } else {
            Budget::full(data)
        };
        budget.epochs = args.epochs.unwrap_or(budget.epochs);
        budget.trajectories = args.trajectories.or(budget.trajectories);
        budget
    };
    let names = args.experiment.data().iter();
    let budgets = names
        .map(|name| ((*name).to_owned(), budget(name)))
        .collect();
    let mut seeds = args.seeds();
    seeds.sort_unstable();
    seeds.dedup();
    if seeds.is_empty() {
        bail!("--seeds: expected at least one");
    }
    // Seed after seed, so that an interrupted run has whole tables of fewer seeds.
    let mut jobs = Vec::new();
    for seed in seeds {
        for data in args.experiment.data() {
            jobs.extend(entries.iter().map(|entry| JobId {
                data: (*data).to_owned(),
                entry: entry.id.to_owned(),
                seed,
            }));
        }
    }
    let plan = Plan {
        entries,
        budgets,
        jobs,
    };
    // What no training would take is refused before any work.
    for job in &plan.jobs {
        plan.training(job)?.check()?;
    }
    Ok(plan)
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
