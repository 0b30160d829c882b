//! Errors of the user's own effects.

use thiserror::Error;

/// An effect of the user's own cannot be used. `place` names the entry of its file, such as ``[wrench] surge``; `part` is the
/// text of the sub-expression; `hint` offers the nearest known name.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum OwnError {
    /// Not TOML, a key that is missing or unknown, or a value of the wrong kind.
    #[error("{what}")]
    Format { what: String },
    /// More of something than is allowed.
    #[error("{what}: {found}, at most {most}")]
    TooMuch {
        what: String,
        found: usize,
        most: usize,
    },
    /// A name that is no name.
    #[error("`{found}` is no name: a letter, then letters, digits and `_`, at most {most} in all")]
    Name { found: String, most: usize },
    /// The name of an effect that is built in.
    #[error("`{found}` is the name of a built-in effect; choose another name for the file")]
    BuiltIn { found: String },
    /// A name that means something else already.
    #[error("{place}: `{found}` stands for {what} already; choose another name")]
    Taken {
        place: String,
        found: String,
        what: String,
    },
    /// A target that no effect can have.
    #[error("target `{found}`; expected `body`, `hinge` or `slide`{hint}")]
    Target { found: String, hint: String },
    /// A part of the file that this target has no use for, or one that it needs.
    #[error("{what}")]
    Parts { what: String },
    /// An axis that does not exist.
    #[error("[{table}] has no `{found}`{hint}; it has: {known}")]
    Axis {
        table: String,
        found: String,
        hint: String,
        known: String,
    },
    /// An expression that is none.
    #[error("{place}, column {column}: {what}, in `{text}`")]
    Syntax {
        place: String,
        column: usize,
        what: String,
        text: String,
    },
    /// A name in an expression that nothing has.
    #[error("{place}: there is no `{found}`{hint}; there are: {known}")]
    UnknownName {
        place: String,
        found: String,
        hint: String,
        known: String,
    },
    /// A unit that is none.
    #[error("{place}: unit `{found}`: {what}")]
    Unit {
        place: String,
        found: String,
        what: String,
    },
    /// Units that do not go together.
    #[error("{place}: `{part}` is in [{found}], expected [{expected}]")]
    Dimension {
        place: String,
        part: String,
        found: String,
        expected: String,
    },
    /// Bounds, a null, a prior or a constant that cannot be.
    #[error("{place}: {what}")]
    Value { place: String, what: String },
    /// A divisor that may be zero.
    #[error(
        "{place}: `{part}` may be zero (it lies between {lower} and {upper}), and it divides; keep it away \
         from zero, for example by max({part}, ...)"
    )]
    Division {
        place: String,
        part: String,
        lower: f64,
        upper: f64,
    },
    /// A function of something that it is not defined for.
    #[error(
        "{place}: {function} of `{part}`, which lies between {lower} and {upper}; {function} needs {needs}"
    )]
    Undefined {
        place: String,
        function: &'static str,
        part: String,
        needs: &'static str,
        lower: f64,
        upper: f64,
    },
    /// A value that may become infinite within the bounds.
    #[error(
        "{place}: `{part}` may be infinite within the bounds; bound it, for example by min(..., ...) or tanh(...)"
    )]
    Unbounded { place: String, part: String },
    /// Expressions that name each other in a circle.
    #[error("{place}: `{name}` depends on itself")]
    Circle { place: String, name: String },
    /// Something happens though nothing should.
    #[error(
        "{place}: with every parameter at its null the effect must be zero, but this may lie between {lower} and {upper}; \
         multiply it by a parameter whose null is zero"
    )]
    NotZero {
        place: String,
        lower: f64,
        upper: f64,
    },
    /// No parameter does anything by itself.
    #[error(
        "no parameter moves the effect away from zero by itself; one must be an amplitude, with the others at their nulls"
    )]
    NoAmplitude,
    /// As many definitions as a process holds.
    #[error("this process knows {most} different definitions of effects already; start a new one")]
    TooManyDefinitions { most: usize },
}
