//! `rollouts.json`.

use std::path::{Component, Path};

use hydro_model::{
    features::FeatureLayout,
    water::{BodyAddedMass, added_mass_fault},
};
use serde::{Deserialize, Serialize};

/// The schema this build reads.
pub const SCHEMA: &str = "hydro-rollouts/1";

/// The index of a folder, `rollouts.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Index {
    /// `hydro-rollouts/1`.
    pub schema: String,
    /// MJCF of the truth, relative to the project.
    pub model: String,
    /// Digest of that file.
    pub model_sha256: String,
    /// Physics step [s].
    pub timestep: f64,
    /// Sample period [s].
    pub sample_period: f64,
    /// Seed of the generator.
    pub seed: u64,
    /// The command that made the folder.
    pub command: String,
    /// MuJoCo's version.
    pub mujoco: String,
    /// Columns of `x`.
    pub features: FeatureLayout,
    /// Joint names, in the order of the features.
    pub joints: Vec<String>,
    /// The water that the runs were recorded in; nothing where it is MuJoCo's own fluid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water: Option<serde_json::Value>,
    /// Added mass that the runs' wrench leaves out, because it belongs into the inertia.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub added_mass: Vec<BodyAddedMass>,
    /// The runs.
    pub rollouts: Vec<Entry>,
}

impl Index {
    /// The first contradiction in the index.
    pub(super) fn fault(&self) -> Option<String> {
        let times = [
            ("timestep", self.timestep),
            ("sample_period", self.sample_period),
        ];
        for (name, seconds) in times {
            // From a microsecond to an hour: neither zero nor another unit.
            if !(1e-6..=3600.0).contains(&seconds) {
                return Some(format!(
                    "{name} is {} s, expected from 1e-6 to 3600",
                    hydro_files::number(seconds)
                ));
            }
        }
        if let Some(fault) = added_mass_fault(&self.added_mass) {
            return Some(fault);
        }
        self.rollouts.iter().find_map(|run| {
            let mut parts = Path::new(&run.file).components();
            let plain = matches!(
                (parts.next(), parts.next()),
                (Some(Component::Normal(_)), None)
            );
            if !plain {
                return Some(format!("`{}` is not a plain file name", run.file));
            }
            let numbers = [("density", run.density), ("duration", run.duration)];
            (numbers.into_iter())
                .find(|(_, value)| !(value.is_finite() && *value >= 0.0))
                .map(|(name, value)| {
                    format!(
                        "{name} of `{}` is {}, expected zero or more",
                        run.file,
                        hydro_files::number(value)
                    )
                })
        })
    }
}

/// One run in the index.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Entry {
    /// File name.
    pub file: String,
    /// Digest of the file, hexadecimal.
    pub sha256: String,
    /// Water density of the run [kg/m^3].
    pub density: f64,
    /// Length of the run [s].
    pub duration: f64,
}
