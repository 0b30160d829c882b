//! Reading a folder of runs, with all checks.

use std::{io::Cursor, path::Path};

use hydro_files::{Archive, Array, NpzError};
use hydro_model::document::hexadecimal;
use sha2::{Digest, Sha256};

use super::{
    error::RolloutError,
    index::{Entry, Index, SCHEMA},
    rollout::Rollout,
    table::Table,
};

/// Largest file of a run [byte].
const LARGEST_FILE: u64 = 1 << 30;

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
            reason: hydro_files::short(reason),
        };
        let text = hydro_files::read_text(&path, hydro_files::TEXT).map_err(|error| {
            unreadable(format!(
                "{error}; a folder of rollouts is made by scripts/record_rollouts.py"
            ))
        })?;
        let head: serde_json::Value =
            serde_json::from_str(&text).map_err(|error| unreadable(error.to_string()))?;
        let schema = head["schema"].as_str().unwrap_or("none");
        if schema != SCHEMA {
            return Err(RolloutError::Schema {
                found: hydro_files::short(schema),
                path,
            });
        }
        let index: Index =
            serde_json::from_value(head).map_err(|error| unreadable(error.to_string()))?;
        if let Some(reason) = index.fault() {
            return Err(unreadable(reason));
        }
        let runs = index
            .rollouts
            .iter()
            .map(|entry| read_run(folder, entry, &index))
            .collect::<Result<_, _>>()?;
        Ok(Self { index, runs })
    }
}

/// Reads one `.npz` after checking its digest.
fn read_run(folder: &Path, entry: &Entry, index: &Index) -> Result<Rollout, RolloutError> {
    let path = folder.join(&entry.file);
    let unreadable = |reason: String| RolloutError::Unreadable {
        path: path.clone(),
        reason: hydro_files::short(reason),
    };
    let bytes =
        hydro_files::read(&path, LARGEST_FILE).map_err(|error| unreadable(error.to_string()))?;
    let found = hexadecimal(&Sha256::digest(&bytes));
    if found != entry.sha256 {
        return Err(RolloutError::Digest {
            path,
            found,
            expected: hydro_files::short(&entry.sha256),
        });
    }
    // The bytes whose digest was taken, whatever happens to the file in the meantime.
    let mut archive =
        Archive::open(Cursor::new(bytes)).map_err(|error| unreadable(error.to_string()))?;
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
    let qvel = reader.read("qvel", Some(samples), 0)?;
    let mut wrench = reader.read("wrench_clean", Some(samples), 6)?;
    if !index.added_mass.is_empty() {
        let gyroscopic = reader.read("gyroscopic", Some(samples), 6)?;
        let pairs = wrench.values.iter_mut().zip(&gyroscopic.values);
        pairs.for_each(|(sum, part)| *sum += part);
    }
    let steps = (index.sample_period / index.timestep).round().max(1.0) as usize;
    let width = steps.saturating_mul(qvel.columns());
    let mut optional = |array, rows, columns| match reader.has(array) {
        true => reader.read(array, Some(rows), columns).map(Some),
        false => Ok(None),
    };
    let generalised = optional("generalised", samples, qvel.columns())?;
    let step_force = optional("step_force", samples - 1, width)?;
    Ok(Rollout {
        name: entry.file.trim_end_matches(".npz").to_owned(),
        density: entry.density,
        qpos: reader.read("qpos", Some(samples), 0)?,
        qvel,
        ctrl: reader.read("ctrl", Some(samples - 1), 0)?,
        push: reader.read("push", Some(samples - 1), 6)?,
        x: reader.read("x", Some(samples), index.features.len())?,
        wrench,
        hydrostatic: reader.read("hydrostatic", Some(samples), 6)?,
        generalised,
        step_force,
        time: time.values,
    })
}

/// Reads and checks the arrays of one archive.
struct ArrayReader<'a> {
    path: &'a Path,
    archive: &'a mut Archive<Cursor<Vec<u8>>>,
}

impl ArrayReader<'_> {
    /// True where the archive has the array.
    fn has(&self, array: &str) -> bool {
        self.archive.names().iter().any(|name| name == array)
    }

    /// Reads `[rows, columns]` (or `[rows]` where `columns` is 1); `None` and 0 stand for any.
    fn read(
        &mut self,
        array: &str,
        rows: Option<usize>,
        columns: usize,
    ) -> Result<Table, RolloutError> {
        let unreadable = |error: NpzError| RolloutError::Unreadable {
            path: self.path.to_owned(),
            reason: error.to_string(),
        };
        let found = self.archive.numbers(array).map_err(unreadable)?;
        let Array { shape, values } = found.ok_or_else(|| RolloutError::MissingArray {
            path: self.path.to_owned(),
            array: array.to_owned(),
            known: self.archive.listed(),
        })?;
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
