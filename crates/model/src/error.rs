//! Errors of building and running a model.

use thiserror::Error;

/// Reason why a model could not be built or run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// Sizes that do not fit together.
    #[error("model configuration: {reason}")]
    Config {
        /// The reason.
        reason: String,
    },
    /// A tensor of another shape than the model's.
    #[error("{what} has shape {found:?}, expected {expected}")]
    Shape {
        /// The argument.
        what: &'static str,
        /// Its shape.
        found: Vec<usize>,
        /// Shape that the model takes.
        expected: String,
    },
    /// An error of the tensor library.
    #[error("tensor operation: {0}")]
    Tensor(String),
}

impl From<candle_core::Error> for ModelError {
    fn from(error: candle_core::Error) -> Self {
        // With a backtrace it has many lines.
        Self::Tensor(hydro_files::short(error))
    }
}
