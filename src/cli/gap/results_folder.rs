//! The folder of results: stages are saved and read back, files of others are never overwritten, and a file is written whole
//! or not at all.

use std::{
    collections::BTreeMap,
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use hydro_files::FolderLock;
use hydro_gap::records::{Added, Found, Named, Verified};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::cli::sha256;

/// Name of the file with the inputs of the folder.
const RUN: &str = "run.json";
/// Schema of that file.
const SCHEMA: &str = "hydro-gap-run/1";
/// The candidate model of `add`, not yet verified.
pub(super) const CANDIDATE: &str = "candidate.xml";
/// The verified model.
pub(super) const PATCHED: &str = "patched.xml";
/// The report.
pub(super) const REPORT: &str = "report.html";
/// The verdict.
pub(super) const VERDICT: &str = "verdict.json";
/// Seconds by stage, and the greatest memory.
pub(super) const TIMING: &str = "timing.json";
/// Files of the stages, in their order.
const STAGES: [&str; 4] = [
    Found::FILE,
    Named::FILE,
    <Option<Added> as Product>::FILE,
    <Option<Verified> as Product>::FILE,
];
/// Folder of the learned residual, a checkpoint.
pub(super) const RESIDUAL: &str = "residual";
/// Its files.
pub(super) const RESIDUAL_FILES: [&str; 2] = ["residual/weights.safetensors", "residual/card.json"];
/// Files that are never overwritten unless they are as this program left them.
const GUARDED: [&str; 6] = [
    CANDIDATE,
    PATCHED,
    REPORT,
    VERDICT,
    RESIDUAL_FILES[0],
    RESIDUAL_FILES[1],
];

/// Result of a stage.
pub(super) trait Product: Serialize + DeserializeOwned {
    /// Name of the stage.
    const STAGE: &'static str;
    /// Name of its file.
    const FILE: &'static str;
    /// Its schema.
    const SCHEMA: &'static str;
    /// Its own schema; `None` where the stage has no result.
    fn schema(&self) -> Option<&str>;
}

macro_rules! product {
    ($kind:ty, $stage:literal, |$self:ident| $schema:expr) => {
        impl Product for $kind {
            const STAGE: &'static str = $stage;
            const FILE: &'static str = concat!($stage, ".json");
            const SCHEMA: &'static str = concat!("hydro-gap-", $stage, "/1");
            fn schema(&self) -> Option<&str> {
                let $self = self;
                $schema
            }
        }
    };
}

product!(Found, "find", |found| Some(&found.schema));
product!(Named, "name", |named| Some(&named.schema));
product!(Option<Added>, "add", |added| added
    .as_ref()
    .map(|a| a.schema.as_str()));
product!(Option<Verified>, "verify", |verified| verified
    .as_ref()
    .map(|v| v.schema.as_str()));

/// Inputs of the folder, and the files written there.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Provenance<I> {
    schema: String,
    /// The last command.
    pub(super) command: String,
    /// The nominal model, as given.
    pub(super) model: String,
    /// The inputs of the stages.
    pub(super) inputs: I,
    /// sha256 of every guarded file; while one is replaced, of the old and of the new one.
    written: BTreeMap<String, Vec<String>>,
}

/// Largest file that is read from the folder [byte].
const LARGEST: u64 = 1 << 30;
/// File of the lock that keeps two processes apart.
const LOCK: &str = ".lock";

/// Makes the folder where it is missing, keeps other processes from it, and removes what a killed one had not finished.
pub(super) fn lock(out: &Path, command: &str) -> anyhow::Result<FolderLock> {
    fs::create_dir_all(out).with_context(|| format!("--out {}", out.display()))?;
    let lock = FolderLock::take(&out.join(LOCK), command)
        .with_context(|| format!("--out {}: wait, or choose another", out.display()))?;
    for folder in [out.to_owned(), out.join(RESIDUAL)] {
        hydro_files::remove_abandoned(&folder);
    }
    Ok(lock)
}

/// A folder of results.
#[derive(Debug)]
pub(super) struct Folder<I> {
    path: PathBuf,
    /// Its inputs.
    pub(super) provenance: Provenance<I>,
}

/// The inputs of a folder; `None` without the file. `I` may read a part of them.
pub(super) fn provenance<I: DeserializeOwned>(out: &Path) -> anyhow::Result<Option<Provenance<I>>> {
    let path = out.join(RUN);
    let Some(text) = read(&path)? else {
        return Ok(None);
    };
    let found = serde_json::from_slice(&text).map_err(hydro_files::short);
    let found: Provenance<I> = found.map_err(anyhow::Error::msg).with_context(|| {
        format!(
            "{} is damaged; delete it and the other files of {} and run again",
            path.display(),
            out.display()
        )
    })?;
    if found.schema != SCHEMA {
        bail!(
            "{}: schema `{}`, expected `{SCHEMA}`",
            path.display(),
            hydro_files::short(found.schema)
        );
    }
    Ok(Some(found))
}

impl<I: Serialize> Folder<I> {
    /// Starts in a folder without results, made where it is missing.
    pub(super) fn start(
        out: &Path,
        model: String,
        command: String,
        inputs: I,
    ) -> anyhow::Result<Self> {
        fs::create_dir_all(out).with_context(|| format!("--out {}", out.display()))?;
        let strangers: Vec<&str> = STAGES
            .into_iter()
            .chain(GUARDED)
            .filter(|name| out.join(name).exists())
            .collect();
        if !strangers.is_empty() {
            bail!(
                "--out {}: holds {}, and no {RUN} says that hydro gap wrote it; choose another folder or \
                 move it away",
                out.display(),
                strangers.join(", ")
            );
        }
        let folder = Self {
            path: out.to_owned(),
            provenance: Provenance {
                schema: SCHEMA.to_owned(),
                command,
                model,
                inputs,
                written: BTreeMap::new(),
            },
        };
        folder.save_provenance()?;
        Ok(folder)
    }

    /// Continues in a folder; a guarded file must be as this program left it.
    pub(super) fn go_on(out: &Path, provenance: Provenance<I>) -> anyhow::Result<Self> {
        let folder = Self {
            path: out.to_owned(),
            provenance,
        };
        for name in GUARDED {
            folder.guard(name)?;
        }
        Ok(folder)
    }

    /// Deletes the results of every stage.
    pub(super) fn clear(&mut self, inputs: I) -> anyhow::Result<()> {
        self.provenance.inputs = inputs;
        for name in STAGES.into_iter().chain([TIMING]) {
            self.delete(name)?;
            self.provenance.written.remove(name);
        }
        for name in GUARDED {
            self.remove(name)?;
        }
        self.remove_residual()?;
        self.save_provenance()
    }

    /// Path of a file.
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The result of a stage; `None` where it has not run.
    pub(super) fn product<P: Product>(&self) -> anyhow::Result<Option<P>> {
        let path = self.file(P::FILE);
        let Some(text) = read(&path)? else {
            return Ok(None);
        };
        let damaged = || {
            format!(
                "{} is damaged; delete it and the stage `{}` runs again",
                path.display(),
                P::STAGE
            )
        };
        let product: P = serde_json::from_slice(&text)
            .map_err(hydro_files::short)
            .map_err(anyhow::Error::msg)
            .with_context(damaged)?;
        if let Some(schema) = product.schema().filter(|schema| *schema != P::SCHEMA) {
            bail!(
                "{}: schema `{schema}`, expected `{}`; delete it and the stage `{}` runs again",
                path.display(),
                P::SCHEMA,
                P::STAGE
            );
        }
        // Folders of earlier versions say nothing of their stages.
        let known = self.provenance.written.get(P::FILE);
        if known.is_some_and(|known| !known.contains(&sha256(&text))) {
            return Err(
                anyhow::Error::msg("its content is not what was written").context(damaged())
            );
        }
        Ok(Some(product))
    }

    /// Saves the result of a stage.
    pub(super) fn keep<P: Product>(&mut self, product: &P) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(product)?;
        // JSON has no NaN: check now that the file can be read back.
        serde_json::from_str::<P>(&text).with_context(|| {
            format!(
                "the stage `{}` gave a number that is not finite, so it cannot be kept",
                P::STAGE
            )
        })?;
        self.replace(P::FILE, text.as_bytes())
    }

    /// Deletes the result of a stage.
    pub(super) fn forget<P: Product>(&mut self) -> anyhow::Result<()> {
        self.delete(P::FILE)?;
        self.provenance.written.remove(P::FILE);
        self.save_provenance()
    }

    /// Writes a guarded file.
    pub(super) fn write(&mut self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        self.guard(name)?;
        self.replace(name, bytes)
    }

    /// Replaces a file, and records its digest.
    fn replace(&mut self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let sha256 = sha256(bytes);
        let known = self.provenance.written.entry(name.to_owned()).or_default();
        known.push(sha256.clone());
        // Old and new digest are recorded before the replacement, in case the program is killed in between.
        self.save_provenance()?;
        let path = self.file(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).with_context(|| format!("making {}", parent.display()))?;
        }
        replace(&path, bytes)?;
        self.provenance
            .written
            .insert(name.to_owned(), vec![sha256]);
        self.save_provenance()
    }

    /// True where this program wrote a file that is gone.
    pub(super) fn lost(&self, name: &str) -> bool {
        self.provenance.written.contains_key(name) && !self.file(name).exists()
    }

    /// Removes the learned residual.
    pub(super) fn remove_residual(&mut self) -> anyhow::Result<()> {
        for name in RESIDUAL_FILES {
            self.remove(name)?;
        }
        // The folder stays where it holds files of others.
        let _ = fs::remove_dir(self.file(RESIDUAL));
        Ok(())
    }

    /// Removes a file that this program wrote.
    pub(super) fn remove(&mut self, name: &str) -> anyhow::Result<()> {
        self.guard(name)?;
        self.delete(name)?;
        if self.provenance.written.remove(name).is_some() {
            self.save_provenance()?;
        }
        Ok(())
    }

    /// Writes a file without guarding it.
    pub(super) fn note(&self, name: &str, value: &impl Serialize) -> anyhow::Result<()> {
        replace(&self.file(name), &serde_json::to_vec_pretty(value)?)
    }

    /// Saves the inputs.
    pub(super) fn save_provenance(&self) -> anyhow::Result<()> {
        self.note(RUN, &self.provenance)
    }

    /// Refuses where a guarded file is not as this program left it.
    fn guard(&self, name: &str) -> anyhow::Result<()> {
        let path = self.file(name);
        let Some(bytes) = read(&path)? else {
            return Ok(());
        };
        let known = self.provenance.written.get(name);
        if known.is_some_and(|known| known.contains(&sha256(&bytes))) {
            return Ok(());
        }
        bail!(
            "{} was not written by hydro gap, or was changed since: it is not overwritten; move it away or \
             choose another --out",
            path.display()
        )
    }

    fn delete(&self, name: &str) -> anyhow::Result<()> {
        let path = self.file(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(error).with_context(|| format!("removing {}", path.display()))
            }
            _ => Ok(()),
        }
    }
}

/// A file's bytes; `None` where there is no file.
pub(super) fn read(path: &Path) -> anyhow::Result<Option<Vec<u8>>> {
    match hydro_files::read(path, LARGEST) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("reading {}", path.display())),
    }
}

/// Replaces a file whole: a reader sees the old one or the new one.
fn replace(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    hydro_files::write_whole(path, bytes).with_context(|| format!("writing {}", path.display()))
}
