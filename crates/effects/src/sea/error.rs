//! Errors of reading waves and currents.

use thiserror::Error;

/// Value of the key `schema` of waves.
pub const WAVES_SCHEMA: &str = "hydro-waves/1";
/// Value of the key `schema` of a current.
pub const CURRENT_SCHEMA: &str = "hydro-current/1";

/// Waves or a current cannot be used. `field` is the place in the file, such as `components[0].period`; `hint` offers the
/// nearest known name.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SeaError {
    /// Not JSON.
    #[error("not JSON, line {line}, column {column}: {what}")]
    Json {
        what: String,
        line: usize,
        column: usize,
    },
    /// A schema that is not the one of the file's kind.
    #[error("`schema`: found {found}, expected `{expected}`")]
    Schema {
        found: String,
        expected: &'static str,
    },
    /// A key that the object does not have.
    #[error("{field}: there is no `{found}`{hint}; there are: {}", known.join(", "))]
    UnknownKey {
        field: String,
        found: String,
        hint: String,
        known: Vec<&'static str>,
    },
    /// A key that must be there.
    #[error("{field}: no `{missing}`, expected {expected}")]
    Missing {
        field: String,
        missing: &'static str,
        expected: String,
    },
    /// Two keys that exclude each other.
    #[error("{field}: found both `{first}` and `{second}`, expected one of them")]
    Both {
        field: String,
        first: &'static str,
        second: &'static str,
    },
    /// A spectrum that does not exist.
    #[error("`spectrum`: there is no `{found}`{hint}; there are: {}", known.join(", "))]
    UnknownSpectrum {
        found: String,
        hint: String,
        known: Vec<&'static str>,
    },
    /// A value of the wrong kind or size.
    #[error("{field}: found {found}, expected {expected}")]
    Value {
        field: String,
        found: String,
        expected: String,
    },
    /// No gravity, or none that pulls down.
    #[error(
        "gravity: found {found} m/s^2, expected a number above zero and at most 1000: gravity makes the waves travel"
    )]
    Gravity { found: f64 },
    /// Waves that would break.
    #[error(
        "{field}: a height of {height:.4} m on a length of {length:.4} m is a steepness of {steepness:.4}, expected at most \
         {limit:.4}, where waves break (a seventh in deep water); lower the height or lengthen the period"
    )]
    Breaking {
        field: String,
        height: f64,
        length: f64,
        steepness: f64,
        limit: f64,
    },
}
