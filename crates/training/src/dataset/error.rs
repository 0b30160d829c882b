//! Reasons to refuse a data set.

use std::{io, path::PathBuf};

use hydro_model::document::listed;
use thiserror::Error;

use super::manifest::SCHEMA;

/// Why a data set was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// No data set there.
    #[error("no data set at {}: manifest.json is missing; there are: {}", folder.display(), listed(found))]
    Missing {
        /// The folder asked for.
        folder: PathBuf,
        /// Names of the files found there.
        found: Vec<String>,
    },
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// The system's error.
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
        /// The fault.
        reason: String,
    },
    /// No such split.
    #[error("no split `{name}` in {}; there are: {}", path.display(), listed(found))]
    UnknownSplit {
        /// The manifest.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// Names of the splits that exist.
        found: Vec<String>,
    },
    /// Torques of joints are asked for, and the data have none.
    #[error(
        "{}: no `generalised`: the data set has the wrench on the base alone ({}), no torques of joints; expected one of \
         gen_task2.py --water strip, or `--outputs wrench`",
        path.display(),
        listed(found)
    )]
    NoGeneralised {
        /// The manifest.
        path: PathBuf,
        /// Its outputs.
        found: Vec<String>,
    },
    /// Shards that the manifest names and the folder lacks.
    #[error("{}: {} of {expected} shards missing: {}", folder.display(), missing.len(), listed(missing))]
    MissingShards {
        /// The data set.
        folder: PathBuf,
        /// Names of the missing files.
        missing: Vec<String>,
        /// Number of shards that the manifest names.
        expected: usize,
    },
    /// Bytes other than those the manifest vouches for.
    #[error("{} is damaged: sha256 is {found}, the manifest says {}; generate the data set again", path.display(), hydro_files::short(expected))]
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
        /// The value.
        value: f32,
    },
}
