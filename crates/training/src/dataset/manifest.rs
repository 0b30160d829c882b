//! `manifest.json`: the data set described.

use std::{
    collections::BTreeMap,
    path::{Component, Path},
};

use hydro_frames::{frames_fault, output_units_fault};
use hydro_model::{
    features::FeatureLayout,
    kinematics::Kinematics,
    outputs::COMPONENTS,
    water::{BodyAddedMass, added_mass_fault},
};
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
    /// Columns of the shards' `generalised`, where they have it: the six components of the wrench, then the joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub generalised: Option<Vec<String>>,
    /// The water that they were made in; nothing where it is MuJoCo's own fluid or that of a recorded model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water: Option<serde_json::Value>,
    /// Added mass that the wrench leaves out, because it belongs into the inertia.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub added_mass: Vec<BodyAddedMass>,
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
        // From a microsecond to an hour: neither zero nor another unit.
        if !(1e-6..=3600.0).contains(&self.sample_period) {
            return Some(format!(
                "sample_period is {} s, expected from 1e-6 to 3600",
                hydro_files::number(self.sample_period)
            ));
        }
        let conventions = self
            .features
            .units_fault(&self.feature_units)
            .or_else(|| output_units_fault(&self.outputs, &self.output_units))
            .or_else(|| frames_fault(&self.frames))
            .or_else(|| self.kinematics.as_ref()?.fault(&self.features))
            .or_else(|| added_mass_fault(&self.added_mass))
            .or_else(|| self.generalised_fault());
        if conventions.is_some() {
            return conventions;
        }
        self.splits.iter().find_map(|(name, split)| {
            let sum = (split.shards.iter())
                .try_fold(0usize, |sum, shard| sum.checked_add(shard.trajectories));
            if sum != Some(split.trajectories) {
                let sum = sum.map_or("more than any memory does".to_owned(), |sum| {
                    sum.to_string()
                });
                return Some(format!(
                    "split `{name}` says {} trajectories, its shards hold {sum}",
                    split.trajectories
                ));
            }
            // A manifest may come from anywhere: its shards lie in its own folder.
            split.shards.iter().find_map(|shard| {
                if self.bytes(shard).is_none() {
                    return Some(format!(
                        "shard `{}` says {} trajectories of {} samples, more than any memory holds",
                        shard.file, shard.trajectories, self.samples
                    ));
                }
                let mut parts = Path::new(&shard.file).components();
                let plain = matches!(
                    (parts.next(), parts.next()),
                    (Some(Component::Normal(_)), None)
                );
                (!plain).then(|| format!("shard `{}` is not a plain file name", shard.file))
            })
        })
    }

    /// The fault in the columns of `generalised`, if there is one.
    fn generalised_fault(&self) -> Option<String> {
        let columns = self.generalised.as_ref()?;
        let (base, joints) = columns.split_at(COMPONENTS.len().min(columns.len()));
        if base != COMPONENTS || joints.is_empty() || self.outputs != COMPONENTS {
            return Some(format!(
                "generalised is {}, expected {} and the joints, beside the same six outputs",
                columns.join(" "),
                COMPONENTS.join(" ")
            ));
        }
        let known = self.features.joints();
        let unknown = joints.iter().find(|joint| !known.contains(joint))?;
        Some(format!(
            "generalised names the joint `{unknown}`, the features: {}",
            known.join(", ")
        ))
    }

    /// Bytes that the numbers of a shard take at least; `None` beyond what can be counted.
    pub(super) fn bytes(&self, shard: &ShardEntry) -> Option<u64> {
        // x, two wrenches, the condition, forces on all degrees of freedom; the times are one row for all.
        let generalised = self.generalised.as_ref().map_or(0, Vec::len);
        let row = (self.features.len() + 2 * self.outputs.len() + 1 + generalised) as u64;
        let rows = (shard.trajectories as u64).checked_mul(self.samples as u64)?;
        let numbers = rows.checked_mul(row)?.checked_add(self.samples as u64)?;
        numbers.checked_mul(4).filter(|bytes| *bytes < 1 << 60)
    }
}
