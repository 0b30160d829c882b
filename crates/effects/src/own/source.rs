//! The file of an effect, as it is written.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::OwnError;

/// Most bytes of a file.
pub const LARGEST_FILE: u64 = 65_536;

/// A definition as its file has it, TOML in `effects.d`, JSON in `effects.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Source {
    /// One line for a person.
    pub(crate) summary: String,
    /// The effect in a sentence, after "the model lacks".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) phrase: Option<String>,
    /// Where the equation is from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) source: Option<String>,
    /// `body`, `hinge` or `slide`.
    pub(crate) target: String,
    /// The only targets, by name; any where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) targets: Vec<String>,
    /// Point of the body, in its frame [m], at which it moves and is pushed; the origin where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) point: Option<[f64; 3]>,
    /// The medium that it is of; none where it acts in all alike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) medium: Option<MediumSource>,
    /// False where the coefficients are the effect itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) idealised: Option<bool>,
    #[serde(default)]
    pub(crate) parameters: BTreeMap<String, ParameterSource>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) constants: BTreeMap<String, ConstantSource>,
    /// Commands of actuators: name in the expressions, name of the actuator.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) commands: BTreeMap<String, String>,
    /// Named intermediates.
    #[serde(default, rename = "let", skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) locals: BTreeMap<String, String>,
    /// Force and torque on a body, in its frame, by axis.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) wrench: BTreeMap<String, String>,
    /// Force on a body, in the world, by axis.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) world_force: BTreeMap<String, String>,
    /// Mass and moment of inertia that move with a body, by axis of its frame.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) inertia: BTreeMap<String, String>,
    /// Force on a joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) force: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) memory: Option<MemorySource>,
}

/// A medium by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum MediumSource {
    Water,
}

/// A parameter that is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ParameterSource {
    pub(crate) unit: String,
    pub(crate) lower: Option<f64>,
    pub(crate) upper: Option<f64>,
    /// The value that means "no effect"; zero where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) null: Option<f64>,
    /// Standard deviation of the prior about the null.
    pub(crate) prior_sd: f64,
}

/// A known number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ConstantSource {
    pub(crate) value: f64,
    pub(crate) unit: String,
}

/// A first-order memory, `memory' = (input - memory) / time_constant`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MemorySource {
    pub(crate) input: String,
    pub(crate) time_constant: String,
}

impl Source {
    /// Reads TOML.
    pub(crate) fn from_toml(text: &str) -> Result<Self, OwnError> {
        if text.len() as u64 > LARGEST_FILE {
            return Err(OwnError::TooMuch {
                what: "bytes of the file".to_owned(),
                found: text.len(),
                most: LARGEST_FILE as usize,
            });
        }
        toml::from_str(text).map_err(|error| OwnError::Format {
            what: error.to_string().trim_end().to_owned(),
        })
    }

    /// The same as JSON on one line, which means the same whatever the file looked like.
    pub(crate) fn to_json(&self) -> Result<String, OwnError> {
        serde_json::to_string(self).map_err(|error| OwnError::Format {
            what: error.to_string(),
        })
    }

    /// Reads that.
    pub(crate) fn from_json(value: &serde_json::Value) -> Result<Self, OwnError> {
        Self::deserialize(value).map_err(|error| OwnError::Format {
            what: error.to_string(),
        })
    }

    /// The equation in plain text.
    pub(crate) fn equation(&self) -> String {
        let listed = |prefix: &str, table: &BTreeMap<String, String>| -> Vec<String> {
            let entries = table.iter();
            entries
                .map(|(name, text)| format!("{prefix}{name} = {text}"))
                .collect()
        };
        let mut parts = listed("wrench ", &self.wrench);
        parts.extend(listed("world force ", &self.world_force));
        parts.extend(listed("inertia ", &self.inertia));
        parts.extend(self.force.iter().map(|text| format!("force = {text}")));
        parts.extend(listed("", &self.locals));
        parts.extend(
            self.memory
                .iter()
                .map(|of| format!("memory' = ({} - memory) / ({})", of.input, of.time_constant)),
        );
        let constants = self.constants.iter();
        parts.extend(constants.map(|(name, of)| format!("{name} = {} {}", of.value, of.unit)));
        parts.join("; ")
    }
}
