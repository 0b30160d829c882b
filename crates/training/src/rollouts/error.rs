//! Reasons to refuse a folder of rollouts.

use std::path::PathBuf;

use thiserror::Error;

use super::index::SCHEMA;

/// Why a folder of rollouts was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RolloutError {
    /// A file is missing or cannot be read.
    #[error("{path}: {reason}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
    /// Another schema.
    #[error("{path}: schema `{found}`; this build reads `{SCHEMA}`", path = path.display())]
    Schema {
        /// The index file.
        path: PathBuf,
        /// The schema found.
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
        /// The expected shape.
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
