//! Reading a folder of runs, with all checks.

use std::{fs::File, io::BufReader, path::Path};

use hydro_model::document::hexadecimal;
use npyz::npz::NpzArchive;
use sha2::{Digest, Sha256};

use super::{
    error::RolloutError,
    index::{Entry, Index, SCHEMA},
    rollout::Rollout,
    table::Table,
};

/// A folder of runs.
#[derive(Clone, Debug)]
pub struct Rollouts {
    /// The folder's index.
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
#[path = "tests/read.rs"]
mod tests;
