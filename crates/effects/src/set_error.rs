//! Errors of reading and writing effects.

use thiserror::Error;

use crate::{Id, MatrixFault, OwnError, Physical};

/// Value of the key `schema` of an `effects.json`.
pub const SCHEMA: &str = "hydro-effects/1";

/// Effects cannot be read or written. `index` is the entry of the list, from zero; `hint` offers the nearest known name.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SetError {
    /// Not JSON.
    #[error("the effects are not JSON, line {line}, column {column}: {what}")]
    Json {
        what: String,
        line: usize,
        column: usize,
    },
    /// A key is missing, superfluous, or holds the wrong kind of value.
    #[error("{place}: found {found}, expected {expected}")]
    Shape {
        place: String,
        found: String,
        expected: String,
    },
    /// A schema that is not this one.
    #[error("the schema is `{found}`, expected `{SCHEMA}`")]
    Schema { found: String },
    /// No such effect.
    #[error("effects[{index}]: there is no effect `{found}`{hint}; there are: {}", known.join(", "))]
    UnknownEffect {
        index: usize,
        found: String,
        hint: String,
        known: Vec<String>,
    },
    /// One of the user's own effects without its definition, or with one that cannot be.
    #[error("effects[{index}], {effect}: {fault}")]
    Definition {
        index: usize,
        effect: String,
        fault: Box<OwnError>,
    },
    /// Two definitions under one name.
    #[error("effects[{index}]: {effect} is defined twice, and not alike")]
    DefinedTwice { index: usize, effect: Id },
    /// A target of the right kind that cannot have the effect.
    #[error("effects[{index}]: {effect} cannot act on {target}: {why}")]
    WrongTarget {
        index: usize,
        effect: Id,
        target: String,
        why: String,
    },
    /// No such target in the model.
    #[error(
        "effects[{index}], {effect}: the model has no {kind} `{found}`{hint}; it has: {}",
        listed(known)
    )]
    UnknownTarget {
        index: usize,
        effect: Id,
        kind: &'static str,
        found: String,
        hint: String,
        known: Vec<String>,
    },
    /// No such parameter of the effect.
    #[error(
        "effects[{index}], {effect} on {target}: there is no parameter `{found}`{hint}; it has: {}",
        listed(known)
    )]
    UnknownParameter {
        index: usize,
        effect: Id,
        target: String,
        found: String,
        hint: String,
        known: Vec<String>,
    },
    /// Parameters that the effect has and the file does not.
    #[error("effects[{index}], {effect} on {target}: missing {}; it has: {}", missing.join(", "), listed(known))]
    MissingParameters {
        index: usize,
        effect: Id,
        target: String,
        missing: Vec<String>,
        known: Vec<String>,
    },
    /// A list of values that is not as long as the effect has parameters.
    #[error("effects[{index}], {effect} on {target}: {found} values for {expected} parameters")]
    WrongCount {
        index: usize,
        effect: Id,
        target: String,
        found: usize,
        expected: usize,
    },
    /// Infinite or not a number.
    #[error(
        "effects[{index}], {effect} on {target}: {parameter} is {value}, expected a finite number"
    )]
    NotFinite {
        index: usize,
        effect: Id,
        target: String,
        parameter: String,
        value: f64,
    },
    /// Outside what physics allows.
    #[error(
        "effects[{index}], {effect} on {target}: {parameter} is {value} [{unit}], expected {expected}"
    )]
    OutOfBounds {
        index: usize,
        effect: Id,
        target: String,
        parameter: String,
        value: f64,
        unit: &'static str,
        expected: Physical,
    },
    /// A whole matrix that no body can have.
    #[error("effects[{index}], {effect} on {target}: {fault}")]
    Matrix {
        index: usize,
        effect: Id,
        target: String,
        fault: MatrixFault,
    },
    /// The same effect twice on the same target.
    #[error("effects[{index}]: {effect} on {target} stands there twice")]
    Twice {
        index: usize,
        effect: Id,
        target: String,
    },
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}
