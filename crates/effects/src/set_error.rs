//! Why effects could not be read or written.

use thiserror::Error;

use crate::Id;

/// Value of the key `schema` of an `effects.json`.
pub const SCHEMA: &str = "hydro-effects/1";

/// Why effects could not be read or written.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SetError {
    /// Not JSON.
    #[error("the effects are not JSON, line {line}, column {column}: {what}")]
    Json {
        /// What the parser says.
        what: String,
        /// Where, from one.
        line: usize,
        /// Where, from one.
        column: usize,
    },
    /// A key is missing, superfluous, or holds the wrong kind of value.
    #[error("{place}: found {found}, expected {expected}")]
    Shape {
        /// Where in the file.
        place: String,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// Another schema.
    #[error("the schema is `{found}`, expected `{SCHEMA}`")]
    Schema {
        /// What the file says.
        found: String,
    },
    /// No such effect.
    #[error("effects[{index}]: there is no effect `{found}`{hint}; there are: {}", known.join(", "))]
    UnknownEffect {
        /// Which entry, from zero.
        index: usize,
        /// What the file says.
        found: String,
        /// The nearest name.
        hint: String,
        /// All names.
        known: Vec<String>,
    },
    /// No such target in the model.
    #[error(
        "effects[{index}], {effect}: the model has no {kind} `{found}`{hint}; it has: {}",
        listed(known)
    )]
    UnknownTarget {
        /// Which entry, from zero.
        index: usize,
        /// Which effect.
        effect: Id,
        /// body, joint, actuator or sensor.
        kind: &'static str,
        /// What the file says.
        found: String,
        /// The nearest name.
        hint: String,
        /// All names.
        known: Vec<String>,
    },
    /// No such parameter of the effect.
    #[error(
        "effects[{index}], {effect} on {target}: there is no parameter `{found}`{hint}; it has: {}",
        listed(known)
    )]
    UnknownParameter {
        /// Which entry, from zero.
        index: usize,
        /// Which effect.
        effect: Id,
        /// On what.
        target: String,
        /// What the file says.
        found: String,
        /// The nearest name.
        hint: String,
        /// All names with their units.
        known: Vec<String>,
    },
    /// Parameters that the effect has and the file does not.
    #[error("effects[{index}], {effect} on {target}: missing {}; it has: {}", missing.join(", "), listed(known))]
    MissingParameters {
        /// Which entry, from zero.
        index: usize,
        /// Which effect.
        effect: Id,
        /// On what.
        target: String,
        /// Which.
        missing: Vec<String>,
        /// All names with their units.
        known: Vec<String>,
    },
    /// A list of values that is not as long as the effect has parameters.
    #[error("effects[{index}], {effect} on {target}: {found} values for {expected} parameters")]
    WrongCount {
        /// Which entry, from zero.
        index: usize,
        /// Which effect.
        effect: Id,
        /// On what.
        target: String,
        /// How many values.
        found: usize,
        /// How many parameters.
        expected: usize,
    },
    /// Infinite or not a number.
    #[error(
        "effects[{index}], {effect} on {target}: {parameter} is {value}, expected a finite number"
    )]
    NotFinite {
        /// Which entry, from zero.
        index: usize,
        /// Which effect.
        effect: Id,
        /// On what.
        target: String,
        /// Which parameter.
        parameter: String,
        /// Its value.
        value: f64,
    },
    /// Beyond the values with a meaning.
    #[error(
        "effects[{index}], {effect} on {target}: {parameter} is {value} [{unit}], expected {lower} to {upper}"
    )]
    OutOfBounds {
        /// Which entry, from zero.
        index: usize,
        /// Which effect.
        effect: Id,
        /// On what.
        target: String,
        /// Which parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Least value.
        lower: f64,
        /// Greatest value.
        upper: f64,
    },
    /// The same effect twice on the same target.
    #[error("effects[{index}]: {effect} on {target} stands there twice")]
    Twice {
        /// The second of the two, from zero.
        index: usize,
        /// Which effect.
        effect: Id,
        /// On what.
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
