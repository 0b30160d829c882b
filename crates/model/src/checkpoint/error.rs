//! Why a checkpoint is refused.

use std::{io, path::PathBuf};

use thiserror::Error;

use super::files::SCHEMA;
use crate::{document::listed, error::ModelError};

/// Why a checkpoint was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// No such folder, or not a checkpoint.
    #[error("no checkpoint at {}: {missing} is missing; there are: {}", folder.display(), listed(found))]
    Missing {
        /// Where it was looked for.
        folder: PathBuf,
        /// What is not there.
        missing: String,
        /// What is there instead.
        found: Vec<String>,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system said.
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
    /// A card that does not say what it must.
    #[error("{}: {reason}", path.display())]
    Card {
        /// The card.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Bytes other than those the card vouches for.
    #[error(
        "{} is damaged: its {bytes} bytes have sha256 {found}, the card says {expected}; fetch or train the checkpoint again",
        path.display()
    )]
    Damaged {
        /// The weights.
        path: PathBuf,
        /// How many bytes there are.
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
    /// A weight that the model needs is not there.
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
    /// A weight that is not a number.
    #[error("{}: tensor `{name}` holds {value} at position {index}", path.display())]
    NonFinite {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Where, in row-major order.
        index: usize,
        /// What.
        value: f32,
    },
    /// The model could not be built.
    #[error(transparent)]
    Model(#[from] ModelError),
}
