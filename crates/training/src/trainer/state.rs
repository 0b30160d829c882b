//! State of a run in one safetensors file: all that it needs to continue exactly where it stopped.

use std::{collections::BTreeMap, path::Path};

use candle_core::{Device, Tensor};
use hydro_model::{
    Parameters,
    document::{digest_difference, hexadecimal},
};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::{
    adamw::AdamW,
    config::TrainConfig,
    device::TrainDevice,
    log::{self, LogRecord},
};
use crate::TrainError;

const SCHEMA: &str = "hydro-training/1";

/// Position in the run; the order of windows is a function of seed and epoch, so no generator is kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Position {
    pub(super) epoch: usize,
    /// Steps done in this epoch.
    pub(super) step_in_epoch: usize,
    /// Steps done in all.
    pub(super) step: usize,
    /// Sum of the losses of this epoch.
    pub(super) loss_sum: f64,
    /// Best validation error; None before the first.
    pub(super) best: Option<f64>,
    /// Epochs since the best.
    pub(super) since_best: usize,
    pub(super) finished: bool,
    /// Value of this epoch, see [`LogRecord::adjoint_error`].
    #[serde(default)]
    pub(super) adjoint_error: Option<f64>,
    pub(super) log: Vec<LogRecord>,
}

/// The file.
pub(super) struct State {
    pub(super) position: Position,
    pub(super) weights: BTreeMap<String, Tensor>,
    pub(super) best: BTreeMap<String, Tensor>,
    pub(super) optimiser: AdamW,
    /// Device of the last steps; another device can continue the run.
    pub(super) device: TrainDevice,
}

#[derive(Serialize, Deserialize)]
struct Header {
    schema: String,
    config: TrainConfig,
    dataset: String,
    optimiser_step: usize,
    #[serde(default)]
    device: TrainDevice,
    #[serde(rename = "place")]
    position: Position,
}

/// Name of the digest in the file.
const DIGEST: &str = "sha256";

/// SHA-256 of the header and of the tensors in the order of their names, hexadecimal.
fn digest<'a>(header: &str, tensors: impl Iterator<Item = (&'a str, &'a [u8])>) -> String {
    let mut hash = Sha256::new();
    hash.update((header.len() as u64).to_le_bytes());
    hash.update(header);
    for (name, bytes) in tensors {
        for part in [name.as_bytes(), bytes] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    hexadecimal(&hash.finalize())
}

/// Writes the file beside `path` and renames it.
pub(super) fn save(
    path: &Path,
    (config, dataset): (&TrainConfig, &str),
    device: TrainDevice,
    position: &Position,
    (parameters, best): (&Parameters, &BTreeMap<String, Tensor>),
    optimiser: &AdamW,
) -> Result<(), TrainError> {
    let numbers = |tensor: &Tensor| tensor.flatten_all()?.to_vec1::<f32>();
    let mut parts: Vec<(String, Vec<f32>)> = Vec::new();
    for (name, var) in parameters.iter() {
        parts.push((format!("weight/{name}"), numbers(var)?));
        if let Some((mean, square)) = optimiser.moments.get(name) {
            parts.push((format!("mean/{name}"), mean.clone()));
            parts.push((format!("square/{name}"), square.clone()));
        }
        if let Some(tensor) = best.get(name) {
            parts.push((format!("best/{name}"), numbers(tensor)?));
        }
    }
    let header = Header {
        schema: SCHEMA.to_owned(),
        config: config.clone(),
        dataset: dataset.to_owned(),
        optimiser_step: optimiser.step,
        device,
        position: position.clone(),
    };
    let refuse = |reason: String| TrainError::State {
        path: path.to_owned(),
        reason,
    };
    let header = serde_json::to_string(&header).map_err(|error| refuse(error.to_string()))?;
    parts.sort_unstable_by(|one, other| one.0.cmp(&other.0));
    let bytes: Vec<(String, usize, Vec<u8>)> = parts
        .into_iter()
        .map(|(name, values)| {
            (
                name,
                values.len(),
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            )
        })
        .collect();
    let views = bytes
        .iter()
        .map(|(name, len, values)| Ok((name, TensorView::new(Dtype::F32, vec![*len], values)?)))
        .collect::<Result<Vec<_>, safetensors::SafeTensorError>>()
        .map_err(|error| refuse(error.to_string()))?;
    let tensors = bytes
        .iter()
        .map(|(name, _, values)| (name.as_str(), values.as_slice()));
    let digest = digest(&header, tensors);
    let metadata = std::collections::HashMap::from([
        ("state".to_owned(), header),
        (DIGEST.to_owned(), digest),
    ]);
    let file =
        safetensors::serialize(views, Some(metadata)).map_err(|error| refuse(error.to_string()))?;
    let file = ordered(file).map_err(|error| refuse(error.to_string()))?;
    log::replace(path, &file)
}

/// The same file with the names of its header in order. Its metadata come in a random one, and equal states shall have equal
/// bytes.
fn ordered(mut file: Vec<u8>) -> serde_json::Result<Vec<u8>> {
    let (length, rest) = file.split_at_mut(8);
    let length = length
        .iter()
        .rev()
        .fold(0, |sum, byte| sum << 8 | usize::from(*byte));
    let header = &mut rest[..length];
    let names: BTreeMap<String, BTreeMap<String, serde_json::Value>> =
        serde_json::from_slice(header)?;
    let mut text = serde_json::to_vec(&names)?;
    text.resize(length, b' ');
    header.copy_from_slice(&text);
    Ok(file)
}

/// Reads a file of the same run: same settings, same data.
pub(super) fn load(
    path: &Path,
    (config, dataset): (&TrainConfig, &str),
    parameters: &Parameters,
) -> Result<State, TrainError> {
    let refuse = |reason: String| TrainError::State {
        path: path.to_owned(),
        reason,
    };
    // Weights, the best ones, two moments; beside them the log of all epochs.
    let most = 16 * parameters.count() as u64 + 2 * hydro_files::TEXT;
    let bytes = hydro_files::read(path, most).map_err(|source| TrainError::Io {
        path: path.to_owned(),
        source,
    })?;
    let damaged = |error: &dyn std::fmt::Display| {
        refuse(format!(
            "not a training state: {}",
            hydro_files::short(error)
        ))
    };
    let (_, metadata) = SafeTensors::read_metadata(&bytes).map_err(|error| damaged(&error))?;
    let header = metadata.metadata().as_ref().and_then(|m| m.get("state"));
    let header = header.ok_or_else(|| refuse("not a training state".to_owned()))?;
    let tensors = SafeTensors::deserialize(&bytes).map_err(|error| damaged(&error))?;
    let expected = (metadata.metadata().as_ref()).and_then(|m| m.get(DIGEST));
    let mut found: Vec<_> = tensors.iter().collect();
    found.sort_unstable_by_key(|(name, _)| *name);
    let found = digest(
        header,
        found.iter().map(|(name, view)| (*name, view.data())),
    );
    // Versions before this one wrote none.
    if expected.is_some_and(|expected| *expected != found) {
        return Err(refuse(
            "damaged: its content is not what was saved".to_owned(),
        ));
    }
    let header: Header = serde_json::from_str(header).map_err(|error| damaged(&error))?;
    if header.schema != SCHEMA {
        return Err(refuse(format!(
            "schema is \"{}\", expected \"{SCHEMA}\"",
            header.schema
        )));
    }
    if let Some(difference) = header.config.difference(config) {
        return Err(refuse(format!("made with other settings: {difference}")));
    }
    if let Some(difference) = digest_difference(&header.dataset, dataset) {
        return Err(refuse(format!(
            "made with another data set: its manifest.json has {difference}"
        )));
    }
    let values = |name: String, count: usize| {
        let view = tensors
            .tensor(&name)
            .map_err(|_| refuse(format!("`{name}` is missing")))?;
        let (words, _) = view.data().as_chunks::<4>();
        if words.len() != count {
            return Err(refuse(format!(
                "`{name}` has {} numbers, expected {count}",
                words.len()
            )));
        }
        Ok(words
            .iter()
            .map(|word| f32::from_le_bytes(*word))
            .collect::<Vec<f32>>())
    };
    let mut state = State {
        weights: BTreeMap::new(),
        best: BTreeMap::new(),
        optimiser: AdamW {
            step: header.optimiser_step,
            moments: BTreeMap::new(),
        },
        device: header.device,
        position: header.position,
    };
    for (name, var) in parameters.iter() {
        let count = var.elem_count();
        let tensor = |kind: &str| {
            let values = values(format!("{kind}/{name}"), count)?;
            Ok::<_, TrainError>(Tensor::from_vec(values, var.shape(), &Device::Cpu)?)
        };
        state.weights.insert(name.to_owned(), tensor("weight")?);
        if state.position.best.is_some() {
            state.best.insert(name.to_owned(), tensor("best")?);
        }
        if state.optimiser.step > 0 {
            let moments = (
                values(format!("mean/{name}"), count)?,
                values(format!("square/{name}"), count)?,
            );
            state.optimiser.moments.insert(name.to_owned(), moments);
        }
    }
    Ok(state)
}
