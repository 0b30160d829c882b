//! `card.json`: what a model is, apart from its weights.

use std::{collections::BTreeMap, path::Path};

use hydro_frames::{frames_fault, output_units_fault};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::{error::CheckpointError, files::SCHEMA};
use crate::{
    architectures::ModelConfig,
    document::{self, Fault, hexadecimal},
    encoding::Encoder,
    envelope::Envelope,
    error::ModelError,
    features::FeatureLayout,
    normaliser::Normaliser,
    solver::Solver,
    water::{BodyAddedMass, added_mass_fault},
};

/// Data set that a model was trained on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DatasetNote {
    /// Name of the data set.
    pub name: String,
    /// SHA-256 of its `manifest.json`, hexadecimal.
    pub sha256: String,
    /// Training trajectories.
    pub trajectories: usize,
}

/// `card.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// [`SCHEMA`].
    pub schema: String,
    /// Name of the model in tables.
    pub name: String,
    /// Kind and sizes.
    #[serde(flatten)]
    pub model: ModelConfig,
    /// Inputs, in order.
    pub features: FeatureLayout,
    /// Their units.
    pub feature_units: Vec<String>,
    /// Components of the wrench and torques of joints, in order; see [`crate::outputs`].
    pub outputs: Vec<String>,
    /// Their units.
    pub output_units: Vec<String>,
    /// Which frame each vector is expressed in.
    pub frames: BTreeMap<String, String>,
    /// Joints that the features name.
    pub joints: Vec<String>,
    /// Time between samples, in seconds.
    pub sample_period: f64,
    /// True if the force is a correction added to that of another model of the water.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub residual: bool,
    /// Solver of the differential equation.
    pub solver: Solver,
    /// Means and deviations of inputs and forces.
    pub normaliser: Normaliser,
    /// Range of the training split, to which the plugin clamps inputs and forces; `None` for no limits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub envelope: Option<Envelope>,
    /// Water that the training data were made in, as their manifest says; `None` where it says nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water: Option<serde_json::Value>,
    /// Added mass that the force leaves out: the plugin puts it into the model's inertia.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub added_mass: Vec<BodyAddedMass>,
    /// Training data.
    pub dataset: Option<DatasetNote>,
    /// Errors on the test split, as reported by training.
    #[serde(default)]
    pub metrics: serde_json::Value,
    /// The command that made it.
    pub command: String,
    /// Version of this package that made it.
    pub hydro: String,
    /// SHA-256 of `weights.safetensors`, hexadecimal; filled in on saving.
    #[serde(default)]
    pub weights_sha256: String,
    /// SHA-256 of all of the card but this field, hexadecimal; filled in on saving. Cards of earlier versions have none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub card_sha256: String,
}

/// Name of the digest's own field.
const DIGEST: &str = "card_sha256";

/// The text of a card with its digest.
pub(super) fn text(card: &Card) -> serde_json::Result<String> {
    let mut card = card.clone();
    card.card_sha256.clear();
    card.card_sha256 = digest(serde_json::from_str(&serde_json::to_string(&card)?)?)?;
    serde_json::to_string_pretty(&card)
}

/// Digest of a card's values, whatever their layout on the page.
fn digest(mut card: serde_json::Value) -> serde_json::Result<String> {
    if let Some(fields) = card.as_object_mut() {
        fields.remove(DIGEST);
    }
    Ok(hexadecimal(&Sha256::digest(serde_json::to_vec(&card)?)))
}

/// Refuses a card that was changed since it was saved.
pub(super) fn check_digest(bytes: &[u8], card: &Card, path: &Path) -> Result<(), CheckpointError> {
    let malformed = |error: serde_json::Error| CheckpointError::Card {
        path: path.to_owned(),
        reason: hydro_files::short(error),
    };
    if card.card_sha256.is_empty() {
        return Ok(());
    }
    let found = serde_json::from_slice(bytes)
        .and_then(digest)
        .map_err(malformed)?;
    if found == card.card_sha256 {
        return Ok(());
    }
    Err(CheckpointError::Card {
        path: path.to_owned(),
        reason: format!(
            "damaged, or changed since it was saved: its content has sha256 {found}, it says {}; fetch or train the \
             checkpoint again, or remove `{DIGEST}` if the change is meant",
            hydro_files::short(&card.card_sha256)
        ),
    })
}

/// Reads a card; another schema is refused first.
pub(super) fn parse_card(bytes: &[u8], path: &Path) -> Result<Card, CheckpointError> {
    let path = path.to_owned();
    document::parse(bytes, SCHEMA).map_err(|fault| match fault {
        Fault::Schema(found) => CheckpointError::Schema { path, found },
        Fault::Malformed(error) => CheckpointError::Card {
            path,
            reason: hydro_files::short(error),
        },
    })
}

/// The refusal of a model that no card can describe.
pub(super) fn model_fault(path: &Path, error: &ModelError) -> CheckpointError {
    CheckpointError::Card {
        path: path.to_owned(),
        reason: hydro_files::short(error),
    }
}

/// Refuses a card whose parts do not fit together.
pub(super) fn check_card(card: &Card, path: &Path) -> Result<(), CheckpointError> {
    let refuse = |reason: String| {
        Err(CheckpointError::Card {
            path: path.to_owned(),
            reason: hydro_files::short(reason),
        })
    };
    let model = &card.model;
    model
        .check()
        .and_then(|()| model.check_solver(card.solver))
        .and_then(|()| model.check_features(&card.features))
        .map_err(|error| model_fault(path, &error))?;
    let inputs = Encoder::new(card.model.encoding(), &card.features).len();
    if card.outputs.is_empty() {
        return refuse("outputs is empty".to_owned());
    }
    if let Some(reason) = card.normaliser.fault(inputs, card.outputs.len()) {
        return refuse(reason);
    }
    // From a microsecond to an hour: neither zero nor another unit.
    if !(1e-6..=3600.0).contains(&card.sample_period) {
        return refuse(format!(
            "sample_period is {} s, expected from 1e-6 to 3600",
            hydro_files::number(card.sample_period)
        ));
    }
    let envelope = card.envelope.as_ref();
    if let Some(reason) = envelope.and_then(|it| it.fault(card.features.len(), card.outputs.len()))
    {
        return refuse(reason);
    }
    let named = card.features.joints();
    if card.joints != named {
        return refuse(format!(
            "joints are {:?}, but the features name {named:?}",
            card.joints
        ));
    }
    let fault = card
        .features
        .units_fault(&card.feature_units)
        .or_else(|| output_units_fault(&card.outputs, &card.output_units))
        .or_else(|| frames_fault(&card.frames))
        .or_else(|| added_mass_fault(&card.added_mass));
    if let Some(reason) = fault {
        return refuse(reason);
    }
    Ok(())
}
