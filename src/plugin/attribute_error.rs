//! Errors of the attributes of `hydro.wrench`.

use std::path::PathBuf;

use hydro_effects::sea::SeaError;
use thiserror::Error;

/// Why an attribute was refused. Every variant names the attribute, what was found and the repair.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AttributeError {
    /// The value does not parse, or lies outside its range.
    #[error("attribute `{attribute}` is `{found}`; expected {expected}")]
    Value {
        /// Its name.
        attribute: &'static str,
        /// The value found.
        found: String,
        /// Allowed values, with their unit.
        expected: &'static str,
    },
    /// The checkpoint's folder does not exist.
    #[error(
        "attribute `checkpoint` is `{found}`; no such folder. Looked in: {}. A relative path is looked \
         for in HYDRO_PATH, the working directory, the folders of the library and the MJCF, and the project above \
         them, which holds `models`",
        list(.tried)
    )]
    NoCheckpoint {
        /// The value found.
        found: String,
        /// The places tried, in order.
        tried: Vec<PathBuf>,
    },
    /// The file of an attribute does not exist.
    #[error(
        "attribute `{attribute}` is `{found}`; no such file, and {otherwise}. Looked in: {}. A \
         relative path is looked for in HYDRO_PATH, the working directory, the folders of the library and the MJCF, and \
         the project above them, which holds `models`",
        list(.tried)
    )]
    NoFile {
        /// Its name.
        attribute: &'static str,
        /// Other forms that the value could have, and has not.
        otherwise: &'static str,
        /// The value found.
        found: String,
        /// The places tried, in order.
        tried: Vec<PathBuf>,
    },
    /// The file of an attribute cannot be read.
    #[error("attribute `{attribute}`: {} cannot be read: {reason}", .path.display())]
    UnreadableFile {
        /// Its name.
        attribute: &'static str,
        /// Which file.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// Waves, a current or a potential flow that are none.
    #[error("attribute `{attribute}`: {source}")]
    Sea {
        /// Its name.
        attribute: &'static str,
        /// Fault of the text.
        #[source]
        source: Box<SeaError>,
    },
    /// Waves, or a hull that makes them, without a surface.
    #[error(
        "attribute `{0}` needs `waterline`, the height of the still surface; add <config key=\"waterline\" value=\"0\"/>"
    )]
    NoSurface(&'static str),
    /// An attribute of the checkpoint where there is none.
    #[error(
        "attribute `{attribute}` is `{found}`, but there is no `checkpoint` that it could act on; take it \
         away, or add <config key=\"checkpoint\" value=\"models/b1-task2\"/>. The values of effects are \
         changed in attribute `effects`"
    )]
    WithoutCheckpoint {
        /// Its name.
        attribute: &'static str,
        /// The value found.
        found: String,
    },
    /// Neither a checkpoint nor effects.
    #[error(
        "attributes `checkpoint` and `effects` are missing; add <config key=\"checkpoint\" \
         value=\"models/b1-task2\"/> (a learned model), <config key=\"effects\" value=\"effects.json\"/> \
         (named effects), or both"
    )]
    Neither,
}

fn list(places: &[PathBuf]) -> String {
    let places: Vec<String> = places
        .iter()
        .map(|place| place.display().to_string())
        .collect();
    places.join(", ")
}
