//! Recorded rollouts of a simulated robot (`hydro-rollouts/1`): states, controls, pushes, features and
//! the true fluid wrench, sampled along runs of one density each.
//!
//! A folder holds `rollouts.json` and one `.npz` (no pickles) a run. Rows `0..=N` are samples; control
//! and push row `k` is held from sample `k` to `k + 1`.

use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use npyz::npz::NpzArchive;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use thiserror::Error;

use hydro_model::{document::hexadecimal, features::FeatureLayout};

/// The schema this build reads.
pub const SCHEMA: &str = "hydro-rollouts/1";

/// Why a folder of rollouts was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RolloutError {
    /// A file is missing or cannot be read.
    #[error("{path}: {reason}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        reason: String,
    },
    /// Another schema.
    #[error("{path}: schema `{found}`; this build reads `{SCHEMA}`", path = path.display())]
    Schema {
        /// The index file.
        path: PathBuf,
        /// What it says.
        found: String,
    },
    /// The file is not the one that the index describes.
    #[error("{path}: sha256 is {found}, the index says {expected}: the file was changed or truncated", path = path.display())]
    Digest {
        /// The rollout.
        path: PathBuf,
        /// Digest of the file.
        found: String,
        /// Digest in the index.
        expected: String,
    },
    /// An array is missing.
    #[error("{path}: no array `{array}`; arrays: {known}", path = path.display())]
    MissingArray {
        /// The rollout.
        path: PathBuf,
        /// The array.
        array: String,
        /// The arrays that exist.
        known: String,
    },
    /// An array of the wrong shape.
    #[error("{path}: array `{array}` has shape {found:?}; expected {expected}", path = path.display())]
    Shape {
        /// The rollout.
        path: PathBuf,
        /// The array.
        array: String,
        /// Its shape.
        found: Vec<u64>,
        /// What it should be.
        expected: String,
    },
    /// Not a number.
    #[error("{path}: array `{array}`, row {row}, column {column}: {value} is not finite", path = path.display())]
    NotFinite {
        /// The rollout.
        path: PathBuf,
        /// The array.
        array: String,
        /// Row of the fault.
        row: usize,
        /// Column of the fault.
        column: usize,
        /// The value.
        value: f64,
    },
}

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

/// A table of numbers, row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    values: Vec<f64>,
    columns: usize,
}

impl Table {
    /// From values row after row; `None` where they do not fill whole rows.
    pub fn new(values: Vec<f64>, columns: usize) -> Option<Self> {
        (columns > 0 && values.len().is_multiple_of(columns)).then_some(Self { values, columns })
    }

    /// Row `index`.
    ///
    /// # Panics
    /// Past the last row.
    pub fn row(&self, index: usize) -> &[f64] {
        &self.values[index * self.columns..(index + 1) * self.columns]
    }

    /// Every row in turn.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns)
    }

    /// How many rows.
    pub fn len(&self) -> usize {
        self.values.len() / self.columns
    }

    /// True where there is no row.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Keeps the first `rows` rows.
    pub fn truncate(&mut self, rows: usize) {
        self.values.truncate(rows * self.columns);
    }

    /// How many columns.
    pub fn columns(&self) -> usize {
        self.columns
    }
}

/// One run: `N + 1` samples, `N` intervals.
#[derive(Clone, Debug)]
pub struct Rollout {
    /// File name without its ending.
    pub name: String,
    /// Water density [kg/m^3].
    pub density: f64,
    /// Sample times [s], `N + 1`.
    pub time: Vec<f64>,
    /// Positions, `[N + 1, nq]`.
    pub qpos: Table,
    /// Velocities, `[N + 1, nv]`.
    pub qvel: Table,
    /// Controls, `[N, nu]`, each held over an interval.
    pub ctrl: Table,
    /// World force [N] and torque [N m] pushed on the base, `[N, 6]`, each held over an interval.
    pub push: Table,
    /// Features, `[N + 1, n]`.
    pub x: Table,
    /// True fluid wrench on the base, base frame, `[N + 1, 6]`.
    pub wrench: Table,
    /// The buoyancy part of `wrench`, `[N + 1, 6]`.
    pub hydrostatic: Table,
}

impl Rollout {
    /// Keeps the first `samples` samples, two at least.
    pub fn truncate(&mut self, samples: usize) {
        let samples = samples.max(2);
        self.time.truncate(samples);
        for table in [&mut self.ctrl, &mut self.push] {
            table.truncate(samples - 1);
        }
        for table in [
            &mut self.qpos,
            &mut self.qvel,
            &mut self.x,
            &mut self.wrench,
            &mut self.hydrostatic,
        ] {
            table.truncate(samples);
        }
    }
}

/// A folder of runs.
#[derive(Clone, Debug)]
pub struct Rollouts {
    /// What the folder says of itself.
    pub index: Index,
    /// The runs, in the order of the index.
    pub runs: Vec<Rollout>,
}

impl Rollouts {
    /// Reads and checks a folder.
    ///
    /// # Errors
    /// On a missing file, another schema or digest, a missing, misshapen or non-finite array.
    pub fn load(folder: &Path) -> Result<Self, RolloutError> {
        let path = folder.join("rollouts.json");
        let unreadable = |reason: String| RolloutError::Unreadable {
            path: path.clone(),
            reason,
        };
        let text = std::fs::read_to_string(&path).map_err(|error| {
            unreadable(format!(
                "{error}; a folder of rollouts is made by scripts/record_rollouts.py"
            ))
        })?;
        let head: serde_json::Value =
            serde_json::from_str(&text).map_err(|error| unreadable(error.to_string()))?;
        let schema = head["schema"].as_str().unwrap_or("none");
        if schema != SCHEMA {
            return Err(RolloutError::Schema {
                found: schema.to_owned(),
                path,
            });
        }
        let index: Index =
            serde_json::from_value(head).map_err(|error| unreadable(error.to_string()))?;
        let runs = index
            .rollouts
            .iter()
            .map(|entry| read_run(folder, entry, index.features.len()))
            .collect::<Result<_, _>>()?;
        Ok(Self { index, runs })
    }
}

/// Reads one `.npz` after checking its digest.
fn read_run(folder: &Path, entry: &Entry, features: usize) -> Result<Rollout, RolloutError> {
    let path = folder.join(&entry.file);
    let unreadable = |reason: String| RolloutError::Unreadable {
        path: path.clone(),
        reason,
    };
    let bytes = std::fs::read(&path).map_err(|error| unreadable(error.to_string()))?;
    let found = hexadecimal(&Sha256::digest(&bytes));
    if found != entry.sha256 {
        return Err(RolloutError::Digest {
            path,
            found,
            expected: entry.sha256.clone(),
        });
    }
    let file = File::open(&path).map_err(|error| unreadable(error.to_string()))?;
    let mut archive =
        NpzArchive::new(BufReader::new(file)).map_err(|error| unreadable(error.to_string()))?;
    let mut reader = ArrayReader {
        path: &path,
        archive: &mut archive,
    };
    let time = reader.read("time", None, 1)?;
    let samples = time.len();
    if samples < 2 {
        return Err(unreadable(format!(
            "{samples} samples; a run holds at least two"
        )));
    }
    Ok(Rollout {
        name: entry.file.trim_end_matches(".npz").to_owned(),
        density: entry.density,
        qpos: reader.read("qpos", Some(samples), 0)?,
        qvel: reader.read("qvel", Some(samples), 0)?,
        ctrl: reader.read("ctrl", Some(samples - 1), 0)?,
        push: reader.read("push", Some(samples - 1), 6)?,
        x: reader.read("x", Some(samples), features)?,
        wrench: reader.read("wrench_clean", Some(samples), 6)?,
        hydrostatic: reader.read("hydrostatic", Some(samples), 6)?,
        time: time.values,
    })
}

/// Reads and checks the arrays of one archive.
struct ArrayReader<'a> {
    path: &'a Path,
    archive: &'a mut NpzArchive<BufReader<File>>,
}

impl ArrayReader<'_> {
    /// Reads `[rows, columns]` (or `[rows]` where `columns` is 1); `None` and 0 stand for any.
    fn read(
        &mut self,
        array: &str,
        rows: Option<usize>,
        columns: usize,
    ) -> Result<Table, RolloutError> {
        let unreadable = |reason: String| RolloutError::Unreadable {
            path: self.path.to_owned(),
            reason: format!("array `{array}`: {reason}"),
        };
        let known: Vec<String> = self.archive.array_names().map(str::to_owned).collect();
        let found = self
            .archive
            .by_name(array)
            .map_err(|error| unreadable(error.to_string()))?;
        let npy = found.ok_or_else(|| RolloutError::MissingArray {
            path: self.path.to_owned(),
            array: array.to_owned(),
            known: known.join(", "),
        })?;
        let shape = npy.shape().to_vec();
        let width = match shape.as_slice() {
            [_] => 1,
            [_, width] => *width as usize,
            _ => 0,
        };
        let height = shape.first().map_or(0, |rows| *rows as usize);
        let fits = width > 0
            && (columns == 0 || width == columns)
            && rows.is_none_or(|rows| height == rows);
        if !fits {
            let any = |wanted: usize| match wanted {
                0 => "any".to_owned(),
                wanted => wanted.to_string(),
            };
            return Err(RolloutError::Shape {
                path: self.path.to_owned(),
                array: array.to_owned(),
                found: shape,
                expected: format!("[{}, {}]", any(rows.unwrap_or(0)), any(columns)),
            });
        }
        let values: Vec<f64> = npy
            .into_vec()
            .map_err(|error| unreadable(error.to_string()))?;
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            return Err(RolloutError::NotFinite {
                path: self.path.to_owned(),
                array: array.to_owned(),
                row: at / width,
                column: at % width,
                value: values[at],
            });
        }
        Ok(Table {
            values,
            columns: width,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn index_with(schema: &str, file: &str, sha256: &str) -> String {
        format!(
            r#"{{"schema":"{schema}","model":"m.xml","model_sha256":"0a","timestep":0.002,"sample_period":0.01,"seed":0,
            "command":"c","mujoco":"4.0.0","features":["density"],"joints":[],
            "rollouts":[{{"file":"{file}","sha256":"{sha256}","density":1000,"duration":0.01}}]}}"#
        )
    }

    fn load(index: &str) -> String {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("rollouts.json"), index).unwrap();
        std::fs::write(folder.path().join("run.npz"), b"no archive").unwrap();
        Rollouts::load(folder.path()).unwrap_err().to_string()
    }

    #[test]
    fn refusals_say_what_was_found() {
        assert!(
            load(&index_with("hydro-rollouts/9", "run.npz", "")).contains("`hydro-rollouts/9`")
        );
        assert!(load(&index_with(SCHEMA, "gone.npz", "")).contains("gone.npz"));
        assert!(load(&index_with(SCHEMA, "run.npz", "00")).contains("changed or truncated"));
        let digest = hexadecimal(&Sha256::digest(b"no archive"));
        assert!(load(&index_with(SCHEMA, "run.npz", &digest)).contains("run.npz"));
        assert!(load("{").contains("rollouts.json"));
        let nowhere = Rollouts::load(Path::new("no/such/folder")).unwrap_err();
        assert!(nowhere.to_string().contains("record_rollouts.py"));
    }
}
