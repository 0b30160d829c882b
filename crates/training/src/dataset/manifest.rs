//! `manifest.json`: the data set described.

use std::{
    collections::BTreeMap,
    path::{Component, Path},
};

use hydro_frames::{frames_fault, output_units_fault};
use hydro_model::{features::FeatureLayout, kinematics::Kinematics};
use serde::{Deserialize, Serialize};

/// The schema that this version reads.
pub const SCHEMA: &str = "hydro-dataset/1";

/// One shard of a split.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardEntry {
    /// File name inside the folder.
    pub file: String,
    /// Trajectories in it.
    pub trajectories: usize,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// One split.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SplitEntry {
    /// Trajectories in all its shards.
    pub trajectories: usize,
    /// Its shards.
    pub shards: Vec<ShardEntry>,
}

/// `manifest.json`; what is not read here is kept as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`SCHEMA`].
    pub schema: String,
    /// Name of the data set.
    pub name: String,
    /// Columns of `x`.
    pub features: FeatureLayout,
    /// Their units.
    pub feature_units: Vec<String>,
    /// Columns of the wrenches.
    pub outputs: Vec<String>,
    /// Their units.
    pub output_units: Vec<String>,
    /// Which frame each vector is expressed in.
    pub frames: BTreeMap<String, String>,
    /// Time between samples, in seconds.
    pub sample_period: f64,
    /// T, samples a trajectory.
    pub samples: usize,
    /// The robot's links, where the generator knows them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kinematics: Option<Kinematics>,
    /// The splits by name.
    pub splits: BTreeMap<String, SplitEntry>,
    /// Seed, versions, model, perturbation.
    #[serde(flatten)]
    pub provenance: BTreeMap<String, serde_json::Value>,
}

impl Manifest {
    /// The first contradiction in the manifest.
    pub(super) fn fault(&self) -> Option<String> {
        if self.outputs.is_empty() || self.samples < 2 {
            return Some(
                "a data set needs at least one output and two samples a trajectory".to_owned(),
            );
        }
        if !(self.sample_period.is_finite() && self.sample_period > 0.0) {
            return Some(format!(
                "sample_period is {} s, expected a positive time",
                self.sample_period
            ));
        }
        let conventions = self
            .features
            .units_fault(&self.feature_units)
            .or_else(|| output_units_fault(&self.outputs, &self.output_units))
            .or_else(|| frames_fault(&self.frames))
            .or_else(|| self.kinematics.as_ref()?.fault(&self.features));
        if conventions.is_some() {
            return conventions;
        }
        self.splits.iter().find_map(|(name, split)| {
            let sum: usize = split.shards.iter().map(|shard| shard.trajectories).sum();
            if sum != split.trajectories {
                return Some(format!(
                    "split `{name}` says {} trajectories, its shards hold {sum}",
                    split.trajectories
                ));
            }
            // A manifest may come from anywhere: its shards lie in its own folder.
            split.shards.iter().find_map(|shard| {
                let mut parts = Path::new(&shard.file).components();
                let plain = matches!(
                    (parts.next(), parts.next()),
                    (Some(Component::Normal(_)), None)
                );
                (!plain).then(|| format!("shard `{}` is not a plain file name", shard.file))
            })
        })
    }
}
