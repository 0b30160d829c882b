//! Jobs of an experiment, checked before any work.

use std::collections::BTreeMap;

use anyhow::{Context as _, bail};
use hydro_training::{
    TrainConfig,
    experiment::{Budget, Entry, JobId, LearningRates, entries},
};

use super::{args::Args, inputs::Inputs};

/// Rows of the tables, and the jobs that train and examine them.
pub(super) struct Plan {
    pub(super) entries: Vec<Entry>,
    /// Budget by the name of the data set.
    pub(super) budgets: BTreeMap<String, Budget>,
    pub(super) jobs: Vec<JobId>,
}

impl Plan {
    /// Rows, budgets and jobs, as the flags ask.
    ///
    /// # Errors
    /// An unknown row, no seed, settings that cannot be trained.
    pub(super) fn new(args: &Args, inputs: &Inputs) -> anyhow::Result<Self> {
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

    /// Training settings of a job.
    pub(super) fn training(&self, job: &JobId) -> anyhow::Result<TrainConfig> {
        let entry = self.entries.iter().find(|entry| entry.id == job.entry);
        let entry = entry.with_context(|| format!("job {job}: no such entry"))?;
        Ok(entry.training(&job.data, &self.budgets[&job.data], job.seed))
    }
}
