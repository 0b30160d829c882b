//! Recorded trajectories on disk: a folder with `manifest.json` and shards, read and checked.
//!
//! A shard `<split>-00000-of-00004.safetensors` holds, for M trajectories of T samples:
//! `x` f32 [M,T,n] (raw SI features), `wrench` f32 [M,T,f] (perturbed), `wrench_clean` f32 [M,T,f],
//! `hydrostatic` f32 [M,T,f] (the buoyancy part of the clean one; zeros where it is absent), `time` f32 [T] and
//! `condition` i32 [M,T]. Splits are by trajectory.
//!
//! This room reads, and writes what this program recorded itself; it neither normalises nor trains.

mod manifest;
mod split;
mod write;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use sha2::{Digest as _, Sha256};
use thiserror::Error;

use hydro_model::document::{hexadecimal, listed, names_in};

pub use self::{
    manifest::{Manifest, SCHEMA, ShardEntry, SplitEntry},
    split::Split,
    write::{Trajectory, write},
};

/// Why a data set was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// No data set there.
    #[error("no data set at {}: manifest.json is missing; there are: {}", folder.display(), listed(found))]
    Missing {
        /// Where it was looked for.
        folder: PathBuf,
        /// What is there instead.
        found: Vec<String>,
    },
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another schema.
    #[error("{}: schema is {found}, expected \"{SCHEMA}\"", path.display())]
    Schema {
        /// The manifest.
        path: PathBuf,
        /// Its schema, as written.
        found: String,
    },
    /// A manifest that does not say what it must.
    #[error("{}: {reason}", path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// No such split.
    #[error("no split `{name}` in {}; there are: {}", path.display(), listed(found))]
    UnknownSplit {
        /// The manifest.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// Those that exist.
        found: Vec<String>,
    },
    /// Shards that the manifest names and the folder lacks.
    #[error("{}: {} of {expected} shards missing: {}", folder.display(), missing.len(), listed(missing))]
    MissingShards {
        /// The data set.
        folder: PathBuf,
        /// Names of the missing files.
        missing: Vec<String>,
        /// How many the manifest names.
        expected: usize,
    },
    /// Bytes other than those the manifest vouches for.
    #[error("{} is damaged: sha256 is {found}, the manifest says {expected}; generate the data set again", path.display())]
    Damaged {
        /// The shard.
        path: PathBuf,
        /// Its sha256.
        found: String,
        /// The manifest's.
        expected: String,
    },
    /// Not a safetensors file.
    #[error("{}: not a safetensors file: {reason}", path.display())]
    Format {
        /// The shard.
        path: PathBuf,
        /// The reader's words.
        reason: String,
    },
    /// A tensor that is missing or of another shape.
    #[error("{}: tensor `{name}` is {found}, expected {expected}", path.display())]
    Tensor {
        /// The shard.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Type and shape found, or that it is missing.
        found: String,
        /// Type and shape expected.
        expected: String,
    },
    /// A value that is not a number.
    #[error("{}: `{tensor}` of trajectory {trajectory}, row {row}, {column} is {value}", path.display())]
    NonFinite {
        /// The shard.
        path: PathBuf,
        /// Which tensor.
        tensor: String,
        /// Trajectory within the shard.
        trajectory: usize,
        /// Sample within the trajectory.
        row: usize,
        /// Feature or force component.
        column: String,
        /// What stands there.
        value: f32,
    },
}

/// An opened data set: the manifest is checked, the shards exist.
///
/// ```no_run
/// use hydro_plugin::dataset::Dataset;
///
/// let dataset = Dataset::open("data/task2".as_ref())?;
/// let train = dataset.split("train", None)?;
/// println!("{} trajectories of {} samples", train.len(), train.samples());
/// # Ok::<(), hydro_plugin::dataset::DatasetError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Dataset {
    folder: PathBuf,
    manifest: Manifest,
    sha256: String,
}

impl Dataset {
    /// Reads the manifest and looks for every shard that it names; shards are read by [`Dataset::split`].
    pub fn open(folder: &Path) -> Result<Self, DatasetError> {
        let path = folder.join("manifest.json");
        if !path.is_file() {
            return Err(DatasetError::Missing {
                folder: folder.to_owned(),
                found: names_in(folder),
            });
        }
        let bytes = fs::read(&path).map_err(|source| DatasetError::Io {
            path: path.clone(),
            source,
        })?;
        let manifest = Manifest::parse(&bytes, &path)?;
        let shards: Vec<&ShardEntry> = manifest
            .splits
            .values()
            .flat_map(|split| &split.shards)
            .collect();
        let missing: Vec<String> = shards
            .iter()
            .filter(|shard| !folder.join(&shard.file).is_file())
            .map(|s| s.file.clone())
            .collect();
        if !missing.is_empty() {
            return Err(DatasetError::MissingShards {
                folder: folder.to_owned(),
                missing,
                expected: shards.len(),
            });
        }
        Ok(Self {
            folder: folder.to_owned(),
            sha256: hexadecimal(&Sha256::digest(&bytes)),
            manifest,
        })
    }

    /// What the data set says of itself.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Of the bytes of `manifest.json`, hexadecimal: names the content, for it holds every shard's sha256.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Where it lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The first `limit` trajectories of a split (all without a limit), in memory.
    pub fn split(&self, name: &str, limit: Option<usize>) -> Result<Split, DatasetError> {
        let mut whole = Split::empty(&self.manifest);
        for shard in self.shards(name)? {
            if limit.is_some_and(|limit| whole.len() >= limit) {
                break;
            }
            whole.append(shard?);
        }
        if let Some(limit) = limit {
            whole.truncate(limit);
        }
        Ok(whole)
    }

    /// The shards of a split one at a time, for what does not fit in memory.
    pub fn shards(
        &self,
        name: &str,
    ) -> Result<impl Iterator<Item = Result<Split, DatasetError>>, DatasetError> {
        let split = self
            .manifest
            .splits
            .get(name)
            .ok_or_else(|| DatasetError::UnknownSplit {
                path: self.folder.join("manifest.json"),
                name: name.to_owned(),
                found: self.manifest.splits.keys().cloned().collect(),
            })?;
        Ok(split
            .shards
            .iter()
            .map(|shard| Split::read(&self.folder, shard, &self.manifest)))
    }
}

#[cfg(test)]
mod tests;
