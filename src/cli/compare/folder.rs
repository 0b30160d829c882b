//! What lies where below `--out`, and what of it can be used.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use hydro_plugin::experiment::{JobId, JobResult, SCHEMA, TrainingNote};

use super::{Inputs, Plan};
use crate::cli::write_whole;

/// The folder of an experiment.
pub(super) struct Folder(PathBuf);

impl Folder {
    pub(super) fn new(out: &Path) -> Self {
        Self(out.to_owned())
    }

    /// Of a job.
    pub(super) fn job(&self, job: &JobId) -> PathBuf {
        let seed = format!("seed-{}", job.seed);
        self.0
            .join("jobs")
            .join(&job.data)
            .join(&job.entry)
            .join(seed)
    }

    /// A file beside the jobs.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The checkpoint that a job trained.
    pub(super) fn checkpoint(&self, job: &JobId) -> PathBuf {
        self.job(job).join("checkpoint")
    }

    /// Where its training keeps its state.
    pub(super) fn run(&self, job: &JobId) -> PathBuf {
        self.job(job).join("run")
    }

    /// The result of a job, if it is done. A model that was examined on other things is to be examined again.
    ///
    /// # Errors
    /// A result of other settings or data: nothing here throws a training away.
    pub(super) fn done(
        &self,
        job: &JobId,
        plan: &Plan,
        inputs: &Inputs,
    ) -> anyhow::Result<Option<JobResult>> {
        let path = self.job(job).join("result.json");
        if !path.is_file() {
            return Ok(None);
        }
        let bytes = fs::read(&path).with_context(|| format!("reading {}", path.display()))?;
        let result: JobResult = serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: not the result of a job", path.display()))?;
        if result.schema != SCHEMA {
            bail!(
                "{}: schema is {}, expected {SCHEMA}",
                path.display(),
                result.schema
            );
        }
        let settings = plan.training(job)?;
        let sha256 = inputs.data[&job.data].sha256();
        let other = if result.settings != settings {
            Some("settings")
        } else if result.data_sha256 != sha256 {
            Some("data")
        } else {
            None
        };
        if let Some(what) = other {
            bail!(
                "{}: made with other {what}; give another --out, or remove {}",
                path.display(),
                self.job(job).display()
            );
        }
        Ok((result.examined_on == inputs.examined_on()).then_some(result))
    }

    /// What training took so far.
    pub(super) fn training(&self, job: &JobId) -> Option<TrainingNote> {
        let bytes = fs::read(self.job(job).join("training.json")).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Notes what training took so far.
    pub(super) fn note_training(&self, job: &JobId, note: &TrainingNote) -> anyhow::Result<()> {
        let path = self.job(job).join("training.json");
        write_whole(&path, serde_json::to_string_pretty(note)?.as_bytes())
    }

    /// Notes a job as done.
    pub(super) fn finish(&self, result: &JobResult) -> anyhow::Result<()> {
        let path = self.job(&result.job).join("result.json");
        write_whole(&path, serde_json::to_string(result)?.as_bytes())
    }
}
