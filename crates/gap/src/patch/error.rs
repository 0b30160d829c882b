//! Why a model cannot be patched.

use std::path::PathBuf;

use thiserror::Error;

use hydro_effects::Id;

/// Why a model cannot be patched. Nothing was written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PatchError {
    /// A file cannot be read.
    #[error("{}: {source}{}", path.display(), of(included_by))]
    Read {
        /// The file.
        path: PathBuf,
        /// The file that includes it.
        included_by: Option<PathBuf>,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file is not the XML that it should be.
    #[error("{}: {detail}", path.display())]
    Xml {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and where.
        detail: String,
    },
    /// An effect acts on something that the model's text does not name.
    #[error(
        "{effect} acts on the {kind} `{target}`, which the model does not name; it has: {}. What a model \
         attaches or replicates has no name in its text",
        list(existing)
    )]
    NoTarget {
        /// Which effect.
        effect: Id,
        /// `body`, `joint`, `actuator`.
        kind: &'static str,
        /// The name looked for.
        target: String,
        /// The names there are.
        existing: Vec<String>,
    },
    /// An effect has more or fewer values than parameters.
    #[error("{effect} on `{target}` has {got} values, expected {}: {}", expected.len(), list(expected))]
    Values {
        /// Which effect.
        effect: Id,
        /// What it acts on.
        target: String,
        /// How many values there are.
        got: usize,
        /// Names of its parameters.
        expected: Vec<String>,
    },
    /// A value that is no number.
    #[error("{effect} on `{target}`: `{name}` is {value}; expected a finite number")]
    NotFinite {
        /// Which effect.
        effect: Id,
        /// What it acts on.
        target: String,
        /// Which parameter.
        name: String,
        /// Its value.
        value: f64,
    },
    /// An effect that acts on the same thing already, and two of which are not one.
    #[error(
        "{effect} acts on `{target}` already; two of them are not one. Change the one that is there"
    )]
    Twice {
        /// Which effect.
        effect: Id,
        /// What it acts on.
        target: String,
    },
    /// The effects that a nominal model has already cannot be read, so none can be added to them.
    #[error(
        "the model's instance of hydro.wrench has the attribute `effects` = `{found}`: {detail}; expected a \
         file or inline JSON of schema hydro-effects/1"
    )]
    Effects {
        /// The attribute.
        found: String,
        /// What is wrong with it.
        detail: String,
    },
    /// A body that the model's text does not name.
    #[error(
        "no body `{body}` in the model's text, so it cannot carry a learned wrench. What a model attaches or \
         replicates has no name in its text"
    )]
    NoBody {
        /// The name looked for.
        body: String,
    },
    /// A body with a learned wrench.
    #[error(
        "`{body}` carries an instance of hydro.wrench with a checkpoint already; it has room for one"
    )]
    LearnedTwice {
        /// Its name.
        body: String,
    },
    /// The file to be written exists.
    #[error(
        "{} exists and holds something else; nothing was written. Move it away or choose another folder",
        path.display()
    )]
    Overwrites {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

fn of(included_by: &Option<PathBuf>) -> String {
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
