//! Errors, which are answered to the driver.

/// Result of every function of this program.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;
