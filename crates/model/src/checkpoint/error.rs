//! Errors of reading and writing checkpoints.

use std::{io, path::PathBuf};

use thiserror::Error;

use super::files::SCHEMA;
use crate::{document::listed, error::ModelError};

/// Reason for refusing a checkpoint.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// No such folder, or not a checkpoint.
    #[error("no checkpoint at {}: {missing} is missing; there are: {}", folder.display(), listed(found))]
    Missing {
        /// The folder.
        folder: PathBuf,
        /// The missing entry.
        missing: String,
        /// Entries that exist.
        found: Vec<String>,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// Another schema.
    #[error("{}: schema is {found}, expected \"{SCHEMA}\"", path.display())]
    Schema {
        /// The card.
        path: PathBuf,
        /// Its schema, as written.
        found: String,
    },
    /// A card that is malformed or contradicts itself.
    #[error("{}: {reason}", path.display())]
    Card {
        /// The card.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// Weights whose SHA-256 is not that of the card.
    #[error(
        "{} is damaged: its {bytes} bytes have sha256 {found}, the card says {expected}; fetch or train the checkpoint again",
        path.display()
    )]
    Damaged {
        /// The weights.
        path: PathBuf,
        /// Their number.
        bytes: usize,
        /// Their sha256.
        found: String,
        /// The card's.
        expected: String,
    },
    /// Not a safetensors file.
    #[error("{}: not a safetensors file: {reason}", path.display())]
    Format {
        /// The weights.
        path: PathBuf,
        /// The reader's words.
        reason: String,
    },
    /// A weight of the model is missing.
    #[error("{}: tensor `{name}` {expected:?} is missing; there are: {}", path.display(), listed(found))]
    MissingTensor {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Its shape.
        expected: Vec<usize>,
        /// Tensors in the file.
        found: Vec<String>,
    },
    /// A weight that the model does not have.
    #[error("{}: tensor `{name}` belongs to no part of the model; expected: {}", path.display(), listed(expected))]
    UnknownTensor {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Tensors of the model.
        expected: Vec<String>,
    },
    /// A weight of another shape or type.
    #[error("{}: tensor `{name}` is {found}, expected F32 {expected:?}", path.display())]
    Shape {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Type and shape found.
        found: String,
        /// Shape of the model's.
        expected: Vec<usize>,
    },
    /// A weight that is not finite.
    #[error("{}: tensor `{name}` holds {value} at position {index}", path.display())]
    NonFinite {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Its row-major position.
        index: usize,
        /// The value.
        value: f32,
    },
    /// A weight that the tensor library cannot read.
    #[error("{}: tensor `{name}`: {reason}", path.display())]
    Tensor {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// The library's words.
        reason: String,
    },
    /// The model could not be built.
    #[error(transparent)]
    Model(#[from] ModelError),
}
