//! Whatever goes wrong is told to who asked.

/// Of everything here.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;
