//! A trained model on disk: a folder with `weights.safetensors` and `card.json`.
//!
//! The card describes the model completely apart from its weights: feature order, units, frames, joints, sample period,
//! sizes, solver, normaliser, training data and errors. Loading refuses anything that does not fit and names it; saving
//! writes a folder beside the target and renames it.

mod card;
mod error;
mod files;
mod replacement;
#[cfg(test)]
mod tests;
mod weights;

use std::{collections::BTreeMap, fs, io, path::Path};

use candle_core::{DType, Tensor};
use sha2::{Digest as _, Sha256};

pub use self::{
    card::{Card, DatasetNote},
    error::CheckpointError,
    files::SCHEMA,
};
use self::{
    files::{CARD, WEIGHTS},
    replacement::{Partial, remove_abandoned, replace},
    weights::numbers,
};
use crate::{
    architectures::{bounds::MOST_WEIGHTS, shapes},
    document::{hexadecimal, names_in},
    encoding::Encoder,
    engine::{Engine, EngineKind},
    force_model::ForceModel,
    parameters,
    solver::Solver,
};

/// Largest file of weights: the most that a model may have, and its header.
const MOST_BYTES: u64 = 4 * MOST_WEIGHTS as u64 + hydro_files::TEXT;

/// A loaded or trained model.
///
/// ```no_run
/// use hydro_model::{EngineKind, Scratch, checkpoint::Checkpoint};
///
/// let checkpoint = Checkpoint::load("models/b1-task2".as_ref())?;
/// let engine = checkpoint.engine(EngineKind::Fused, None)?;
/// let mut force = vec![0.0; engine.outputs()];
/// engine.estimate(&vec![0.0; engine.inputs()], &mut force, &mut Scratch::default());
/// # Ok::<(), hydro_model::checkpoint::CheckpointError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// Description of the model.
    pub card: Card,
    weights: BTreeMap<String, Tensor>,
}

impl Checkpoint {
    /// A checkpoint of a card and named weights, checked as on loading.
    pub fn new(card: Card, weights: BTreeMap<String, Tensor>) -> Result<Self, CheckpointError> {
        Self::checked(card, weights, Path::new("<memory>"))
    }

    /// Reads and checks a folder.
    pub fn load(folder: &Path) -> Result<Self, CheckpointError> {
        let missing = |missing: &str, found: Vec<String>| CheckpointError::Missing {
            folder: folder.to_owned(),
            missing: missing.to_owned(),
            found,
        };
        if !folder.is_dir() {
            let beside = folder
                .parent()
                .filter(|parent| !parent.as_os_str().is_empty());
            return Err(missing(
                "the folder",
                names_in(beside.unwrap_or(Path::new("."))),
            ));
        }
        for name in [CARD, WEIGHTS] {
            if !folder.join(name).exists() {
                return Err(missing(name, names_in(folder)));
            }
        }
        let read = |name: &str, most: u64| {
            let path = folder.join(name);
            hydro_files::read(&path, most).map_err(|source| CheckpointError::Io { path, source })
        };
        let text = read(CARD, hydro_files::TEXT)?;
        let card = card::parse_card(&text, &folder.join(CARD))?;
        card::check_digest(&text, &card, &folder.join(CARD))?;
        let path = folder.join(WEIGHTS);
        let bytes = read(WEIGHTS, MOST_BYTES)?;
        let found = hexadecimal(&Sha256::digest(&bytes));
        if found != card.weights_sha256 {
            return Err(CheckpointError::Damaged {
                path,
                bytes: bytes.len(),
                found,
                expected: hydro_files::short(card.weights_sha256),
            });
        }
        let weights = weights::parse(&bytes, &path)?;
        Self::checked(card, weights, folder)
    }

    /// Writes the folder beside `folder` and renames it; an older checkpoint stays in place and
    /// whole until then. Leftovers of runs that were killed while saving are removed.
    pub fn save(&self, folder: &Path) -> Result<(), CheckpointError> {
        let io = |path: &Path| {
            let path = path.to_owned();
            move |source| CheckpointError::Io { path, source }
        };
        let parent = folder
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        fs::create_dir_all(parent).map_err(io(parent))?;
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let partial = Partial::new(parent, &name).map_err(io(parent))?;
        let new = partial.folder.join("new");
        fs::create_dir(&new).map_err(io(&new))?;

        let weights = weights::serialise(&self.weights)?;
        let mut card = self.card.clone();
        card.weights_sha256 = hexadecimal(&Sha256::digest(&weights));
        let text = card::text(&card).map_err(|error| CheckpointError::Card {
            path: folder.join(CARD),
            reason: error.to_string(),
        })?;
        for (name, bytes) in [(WEIGHTS, weights.as_slice()), (CARD, text.as_bytes())] {
            let path = new.join(name);
            let write = || {
                let mut file = fs::File::create(&path)?;
                io::Write::write_all(&mut file, bytes)?;
                file.sync_all()
            };
            write().map_err(io(&path))?;
        }

        replace(&new, folder, &partial.folder.join("old")).map_err(io(folder))?;
        // Only now: a run killed in a file system without exchange may have left its only copy there.
        remove_abandoned(parent, &name);
        Ok(())
    }

    /// The weights by name.
    pub fn weights(&self) -> &BTreeMap<String, Tensor> {
        &self.weights
    }

    /// Numbers in all weights together.
    pub fn parameter_count(&self) -> usize {
        self.weights.values().map(Tensor::elem_count).sum()
    }

    /// The model, with the card's solver or another.
    pub fn model(&self, solver: Option<Solver>) -> Result<ForceModel, CheckpointError> {
        let card = &self.card;
        let vb = parameters::builder(&self.weights);
        let solver = solver.unwrap_or(card.solver);
        Ok(ForceModel::new(
            &card.model,
            &card.features,
            card.normaliser.clone(),
            solver,
            vb,
        )?)
    }

    /// An evaluator of single samples, with the card's solver or another.
    pub fn engine(
        &self,
        kind: EngineKind,
        solver: Option<Solver>,
    ) -> Result<Box<dyn Engine>, CheckpointError> {
        Ok(self.model(solver)?.engine(kind)?)
    }

    /// SHA-256 of the content: equal for equal cards and weights, on any machine.
    pub fn digest(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        let mut card = self.card.clone();
        card.weights_sha256.clear();
        card.card_sha256.clear();
        // A card is plain data with text keys; it always serialises.
        hash.update(serde_json::to_vec(&card).unwrap_or_default());
        for (name, tensor) in &self.weights {
            hash.update(name);
            for value in numbers(tensor, Path::new(WEIGHTS), name).unwrap_or_default() {
                hash.update(value.to_le_bytes());
            }
        }
        hash.finalize().into()
    }

    fn checked(
        card: Card,
        weights: BTreeMap<String, Tensor>,
        folder: &Path,
    ) -> Result<Self, CheckpointError> {
        card::check_card(&card, &folder.join(CARD))?;
        let path = folder.join(WEIGHTS);
        // The card's sizes are held against the tensors that are there: nothing of these sizes is made.
        let inputs = Encoder::new(card.model.encoding(), &card.features).len();
        let expected = shapes::shapes(&card.model, inputs, card.outputs.len())
            .map_err(|error| card::model_fault(&folder.join(CARD), &error))?;
        for (name, shape) in &expected {
            let Some(tensor) = weights.get(name) else {
                return Err(CheckpointError::MissingTensor {
                    path,
                    name: name.to_owned(),
                    expected: shape.clone(),
                    found: weights.keys().cloned().collect(),
                });
            };
            if tensor.dims() != shape.as_slice() || tensor.dtype() != DType::F32 {
                return Err(CheckpointError::Shape {
                    path,
                    name: name.to_owned(),
                    found: format!("{:?} {:?}", tensor.dtype(), tensor.dims()),
                    expected: shape.clone(),
                });
            }
            let values = numbers(tensor, &path, name)?;
            if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                return Err(CheckpointError::NonFinite {
                    path,
                    name: name.clone(),
                    index,
                    value: values[index],
                });
            }
        }
        if let Some(name) = weights.keys().find(|name| !expected.contains_key(*name)) {
            return Err(CheckpointError::UnknownTensor {
                path,
                name: name.clone(),
                expected: expected.into_keys().collect(),
            });
        }
        Ok(Self { card, weights })
    }
}
