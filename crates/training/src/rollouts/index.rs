//! `rollouts.json`.

use hydro_model::features::FeatureLayout;
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
    /// The runs.
    pub rollouts: Vec<Entry>,
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
