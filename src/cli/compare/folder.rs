//! Layout of the folder `--out`, and checks of the files found there.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use hydro_files::FolderLock;
use hydro_model::document::digest_difference;
use hydro_training::{
    TrainConfig,
    experiment::{JobId, JobResult, SCHEMA, TrainingNote},
};
use serde::{Deserialize, Serialize};

use super::{inputs::Inputs, plan::Plan};
use crate::cli::{command_line::command_line, files::write_whole};

/// `training.json`: settings and data of a job's training, and its cost so far.
#[derive(Serialize, Deserialize)]
struct Training {
    settings: TrainConfig,
    data_sha256: String,
    #[serde(flatten)]
    note: TrainingNote,
}

/// The folder of an experiment.
pub(super) struct Folder(PathBuf);

impl Folder {
    pub(super) fn new(out: &Path) -> Self {
        Self(out.to_owned())
    }

    /// Folder of a job.
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

    /// Folder of the figures.
    pub(super) fn figures(&self) -> PathBuf {
        self.file("figures")
    }

    /// The checkpoint that a job trained.
    pub(super) fn checkpoint(&self, job: &JobId) -> PathBuf {
        self.job(job).join("checkpoint")
    }

    /// Folder in which its training keeps its state.
    pub(super) fn run(&self, job: &JobId) -> PathBuf {
        self.job(job).join("run")
    }

    /// Keeps other processes from a job, as long as the lock lives.
    ///
    /// # Errors
    /// Another process at work on it.
    pub(super) fn lock(&self, job: &JobId) -> anyhow::Result<FolderLock> {
        let folder = self.job(job);
        let place = || format!("{job} in {}", folder.display());
        fs::create_dir_all(&folder).with_context(place)?;
        FolderLock::take(&folder.join(".lock"), &command_line()).with_context(place)
    }

    /// Removes what killed processes left of jobs on which none is at work now.
    pub(super) fn remove_abandoned(&self, jobs: &[JobId]) {
        hydro_files::remove_abandoned(&self.0);
        hydro_files::remove_abandoned(&self.figures());
        for job in jobs.iter().filter(|job| self.job(job).is_dir()) {
            if let Ok(_lock) = self.lock(job) {
                hydro_files::remove_abandoned(&self.job(job));
                hydro_files::remove_abandoned(&self.run(job));
            }
        }
    }

    /// True where an earlier process began a job, which the next one goes on with.
    pub(super) fn begun(&self, job: &JobId) -> bool {
        self.run(job).join("state.safetensors").exists() || self.checkpoint(job).exists()
    }

    /// The result of a job, if it is done. A model examined on other data or scenes is not: it is examined again.
    ///
    /// # Errors
    /// A result of other settings or data; no training is thrown away unasked.
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
        let bytes = hydro_files::read(&path, hydro_files::TEXT)
            .with_context(|| format!("reading {}", path.display()))?;
        let result: JobResult = serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: not the result of a job", path.display()))?;
        if result.schema != SCHEMA {
            bail!(
                "{}: schema is {}, expected {SCHEMA}",
                path.display(),
                result.schema
            );
        }
        let made = (&result.settings, result.data_sha256.as_str());
        self.refuse_other(&path, job, plan, inputs, made)?;
        Ok((result.examined_on == inputs.examined_on()).then_some(result))
    }

    /// Cost of the training so far, if it was with these settings on these data.
    ///
    /// # Errors
    /// A training of other settings or data.
    pub(super) fn training(
        &self,
        job: &JobId,
        plan: &Plan,
        inputs: &Inputs,
    ) -> anyhow::Result<Option<TrainingNote>> {
        let path = self.job(job).join("training.json");
        if !path.is_file() {
            return Ok(None);
        }
        let bytes = hydro_files::read(&path, hydro_files::TEXT)
            .with_context(|| format!("reading {}", path.display()))?;
        let found: Training = serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: not the note of a training", path.display()))?;
        self.refuse_other(
            &path,
            job,
            plan,
            inputs,
            (&found.settings, &found.data_sha256),
        )?;
        Ok(Some(found.note))
    }

    /// Writes the cost of the training so far.
    pub(super) fn note_training(
        &self,
        job: &JobId,
        settings: &TrainConfig,
        data_sha256: &str,
        note: &TrainingNote,
    ) -> anyhow::Result<()> {
        let path = self.job(job).join("training.json");
        let training = Training {
            settings: settings.clone(),
            data_sha256: data_sha256.to_owned(),
            note: *note,
        };
        write_whole(&path, serde_json::to_string_pretty(&training)?.as_bytes())
    }

    fn refuse_other(
        &self,
        path: &Path,
        job: &JobId,
        plan: &Plan,
        inputs: &Inputs,
        (settings, sha256): (&TrainConfig, &str),
    ) -> anyhow::Result<()> {
        let data = || {
            let difference = digest_difference(sha256, inputs.data[&job.data].sha256())?;
            Some(format!("data: its manifest.json has {difference}"))
        };
        let settings = settings.difference(&plan.training(job)?);
        let settings = settings.map(|difference| format!("settings: {difference}"));
        match settings.or_else(data) {
            None => Ok(()),
            Some(other) => bail!(
                "{}: made with other {other}; give another --out, or remove {}",
                path.display(),
                self.job(job).display()
            ),
        }
    }

    /// Writes the result of a job, which is then done.
    pub(super) fn finish(&self, result: &JobResult) -> anyhow::Result<()> {
        let path = self.job(&result.job).join("result.json");
        write_whole(&path, serde_json::to_string(result)?.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_a_killed_process_left_is_removed_from_every_folder() {
        let place = tempfile::tempdir().unwrap();
        let folder = Folder::new(place.path());
        let job = JobId {
            data: "task2".to_owned(),
            entry: "mlp".to_owned(),
            seed: 3,
        };
        let (run, figures) = (folder.run(&job), folder.figures());
        let places = [place.path(), &folder.job(&job), &run, &figures];
        for each in places {
            fs::create_dir_all(each).unwrap();
            fs::write(each.join(".hydro-a1b2c3.part"), "half").unwrap();
            fs::write(each.join("kept"), "whole").unwrap();
        }
        folder.remove_abandoned(&[job]);
        for each in places {
            assert!(
                !each.join(".hydro-a1b2c3.part").exists(),
                "{}",
                each.display()
            );
            assert!(each.join("kept").exists(), "{}", each.display());
        }
    }
}
