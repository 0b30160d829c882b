//! Opening a data set and reading its splits.

use std::path::{Path, PathBuf};

use hydro_model::{
    Output, Outputs,
    document::{self, Fault, hexadecimal, names_in},
};
use sha2::{Digest as _, Sha256};

use super::{
    error::DatasetError,
    manifest::{Manifest, SCHEMA, ShardEntry},
    split::Split,
};

/// An opened data set: the manifest is checked, the shards exist.
///
/// ```no_run
/// use hydro_training::dataset::Dataset;
///
/// let dataset = Dataset::open("data/task2".as_ref())?;
/// let train = dataset.split("train", None)?;
/// println!("{} trajectories of {} samples", train.len(), train.samples());
/// # Ok::<(), hydro_training::dataset::DatasetError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Dataset {
    folder: PathBuf,
    manifest: Manifest,
    sha256: String,
    /// Joints whose torques follow the wrench in every row of forces.
    joints: usize,
}

impl Dataset {
    /// Reads the manifest and looks for every shard that it names; shards are read by [`Dataset::split`].
    pub fn open(folder: &Path) -> Result<Self, DatasetError> {
        let path = folder.join("manifest.json");
        if !path.exists() {
            return Err(DatasetError::Missing {
                folder: folder.to_owned(),
                found: names_in(folder),
            });
        }
        let io = |path: &Path| {
            let path = path.to_owned();
            move |source| DatasetError::Io { path, source }
        };
        let bytes = hydro_files::read(&path, hydro_files::TEXT).map_err(io(&path))?;
        let manifest = parse_manifest(&bytes, &path)?;
        let shards: Vec<&ShardEntry> = manifest
            .splits
            .values()
            .flat_map(|split| &split.shards)
            .collect();
        let missing: Vec<String> = shards
            .iter()
            .filter(|shard| !folder.join(&shard.file).exists())
            .map(|s| s.file.clone())
            .collect();
        if !missing.is_empty() {
            return Err(DatasetError::MissingShards {
                folder: folder.to_owned(),
                missing,
                expected: shards.len(),
            });
        }
        for shard in shards {
            let path = folder.join(&shard.file);
            hydro_files::open(&path, u64::MAX).map_err(io(&path))?;
        }
        Ok(Self {
            folder: folder.to_owned(),
            sha256: hexadecimal(&Sha256::digest(&bytes)),
            manifest,
            joints: 0,
        })
    }

    /// The same data with these outputs: with [`Outputs::Generalised`] the torques of the joints follow the wrench. They
    /// come from the shards' `generalised`, without perturbation.
    ///
    /// # Errors
    /// A data set without `generalised`.
    pub fn with_outputs(mut self, outputs: Outputs) -> Result<Self, DatasetError> {
        if outputs == Outputs::Wrench || self.joints > 0 {
            return Ok(self);
        }
        let columns = self.manifest.generalised.as_ref();
        let joints = columns.map_or(&[][..], |columns| &columns[self.manifest.outputs.len()..]);
        if joints.is_empty() {
            return Err(DatasetError::NoGeneralised {
                path: self.folder.join("manifest.json"),
                found: self.manifest.outputs.clone(),
            });
        }
        self.joints = joints.len();
        for joint in joints {
            let name = Output::Joint(joint.clone()).to_string();
            self.manifest.outputs.push(name);
            self.manifest.output_units.push("N m".to_owned());
        }
        Ok(self)
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// SHA-256 of `manifest.json`, hexadecimal. It identifies the content, since the manifest holds every shard's sha256.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The folder.
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
            .map(|shard| Split::read(&self.folder, shard, &self.manifest, self.joints)))
    }
}

/// Parses and checks `manifest.json`.
fn parse_manifest(bytes: &[u8], path: &Path) -> Result<Manifest, DatasetError> {
    let manifest: Manifest = document::parse(bytes, SCHEMA).map_err(|fault| match fault {
        Fault::Schema(found) => DatasetError::Schema {
            path: path.to_owned(),
            found,
        },
        Fault::Malformed(error) => DatasetError::Manifest {
            path: path.to_owned(),
            reason: hydro_files::short(error),
        },
    })?;
    match manifest.fault() {
        Some(reason) => Err(DatasetError::Manifest {
            path: path.to_owned(),
            reason: hydro_files::short(reason),
        }),
        None => Ok(manifest),
    }
}

#[cfg(test)]
#[path = "tests/reader.rs"]
mod tests;
