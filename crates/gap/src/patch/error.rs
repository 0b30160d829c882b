//! Errors of the patch.

use std::path::PathBuf;

use thiserror::Error;

use hydro_effects::Id;

/// A model cannot be patched; nothing was written.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PatchError {
    /// A file cannot be read.
    #[error("{}: {source}{}", path.display(), included_from(included_by))]
    Read {
        path: PathBuf,
        included_by: Option<PathBuf>,
        source: std::io::Error,
    },
    /// A file is not the XML that it should be.
    #[error("{}: {detail}", path.display())]
    Xml { path: PathBuf, detail: String },
    /// An effect acts on something that the model's text does not name.
    #[error(
        "{effect} acts on the {kind} `{target}`, which the model does not name; it has: {}. What a model \
         attaches or replicates has no name in its text",
        list(existing)
    )]
    NoTarget {
        effect: Id,
        kind: &'static str,
        target: String,
        existing: Vec<String>,
    },
    /// An effect has more or fewer values than parameters.
    #[error("{effect} on `{target}` has {got} values, expected {}: {}", expected.len(), list(expected))]
    Values {
        effect: Id,
        target: String,
        got: usize,
        expected: Vec<String>,
    },
    /// A value that is no number.
    #[error("{effect} on `{target}`: `{name}` is {value}; expected a finite number")]
    NotFinite {
        effect: Id,
        target: String,
        name: String,
        value: f64,
    },
    /// An effect that acts on the same thing already, and two of which are not one.
    #[error(
        "{effect} acts on `{target}` already; two of them are not one. Change the one that is there"
    )]
    Twice { effect: Id, target: String },
    /// The effects that a nominal model has already cannot be read, so none can be added to them.
    #[error(
        "the model's instance of hydro.wrench has the attribute `effects` = `{found}`: {detail}; expected a \
         file or inline JSON of schema hydro-effects/1"
    )]
    Effects { found: String, detail: String },
    /// A body that the model's text does not name.
    #[error(
        "no body `{body}` in the model's text, so it cannot carry a learned wrench. What a model attaches or \
         replicates has no name in its text"
    )]
    NoBody { body: String },
    /// A body with a learned wrench.
    #[error(
        "`{body}` carries an instance of hydro.wrench with a checkpoint already; it has room for one"
    )]
    LearnedTwice { body: String },
    /// The file to be written exists.
    #[error(
        "{} exists and holds something else; nothing was written. Move it away or choose another folder",
        path.display()
    )]
    Overwrites { path: PathBuf },
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
}

fn included_from(included_by: &Option<PathBuf>) -> String {
    included_by
        .as_ref()
        .map(|path| format!(" (included by {})", path.display()))
        .unwrap_or_default()
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}
