//! A trained model on disk: a folder with `weights.safetensors` and `card.json`.
//!
//! The card is all that the plugin knows of a model: feature order, units, frames, joints, sample period, sizes,
//! solver, normaliser, where it was trained and how well it did. Loading refuses, by name, whatever does not fit;
//! saving writes a folder beside the target and renames it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path, PathBuf},
};

use candle_core::{DType, Device, Tensor};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use thiserror::Error;

use crate::{
    features::FeatureLayout,
    frames::{frames_fault, output_units_fault},
    model::{
        Encoder, Engine, EngineKind, ForceModel, ModelConfig, ModelError, Network, Normaliser,
        Parameters, Solver, parameters,
    },
};

/// The schema that this version writes and reads.
pub const SCHEMA: &str = "hydro-checkpoint/1";
/// Name of the weights inside the folder.
const WEIGHTS: &str = "weights.safetensors";
/// Name of the card inside the folder.
const CARD: &str = "card.json";

/// Where a model was trained.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DatasetNote {
    /// Name of the data set.
    pub name: String,
    /// Of the bytes of its `manifest.json`, hexadecimal.
    pub sha256: String,
    /// Training trajectories.
    pub trajectories: usize,
}

/// `card.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// [`SCHEMA`].
    pub schema: String,
    /// What the model is called in tables.
    pub name: String,
    /// Kind and sizes.
    #[serde(flatten)]
    pub model: ModelConfig,
    /// Inputs, in order.
    pub features: FeatureLayout,
    /// Their units.
    pub feature_units: Vec<String>,
    /// Force components, in order.
    pub outputs: Vec<String>,
    /// Their units.
    pub output_units: Vec<String>,
    /// Which frame each vector is expressed in.
    pub frames: BTreeMap<String, String>,
    /// Joints that the features name.
    pub joints: Vec<String>,
    /// Time between samples, in seconds.
    pub sample_period: f64,
    /// True where the force is only what another model of the water lacks: it acts beside that one.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub residual: bool,
    /// How the ODE is stepped.
    pub solver: Solver,
    /// Means and deviations of inputs and forces.
    pub normaliser: Normaliser,
    /// Where it was trained.
    pub dataset: Option<DatasetNote>,
    /// Errors on the test split, as the training room reports them.
    #[serde(default)]
    pub metrics: serde_json::Value,
    /// The command that made it.
    pub command: String,
    /// Version of this package that made it.
    pub hydro: String,
    /// Of the bytes of `weights.safetensors`, hexadecimal; filled in on saving.
    #[serde(default)]
    pub weights_sha256: String,
}

/// Why a checkpoint was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// No such folder, or not a checkpoint.
    #[error("no checkpoint at {}: {missing} is missing; there are: {}", folder.display(), listed(found))]
    Missing {
        /// Where it was looked for.
        folder: PathBuf,
        /// What is not there.
        missing: String,
        /// What is there instead.
        found: Vec<String>,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another schema.
    #[error("{}: schema is {found}, expected \"{SCHEMA}\"", path.display())]
    Schema {
        /// The card.
        path: PathBuf,
        /// Its schema, as written.
        found: String,
    },
    /// A card that does not say what it must.
    #[error("{}: {reason}", path.display())]
    Card {
        /// The card.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Bytes other than those the card vouches for.
    #[error(
        "{} is damaged: its {bytes} bytes have sha256 {found}, the card says {expected}; fetch or train the checkpoint again",
        path.display()
    )]
    Damaged {
        /// The weights.
        path: PathBuf,
        /// How many bytes there are.
        bytes: usize,
        /// Their sha256.
        found: String,
        /// The card's.
        expected: String,
    },
    /// Not a safetensors file.
    #[error("{}: not a safetensors file: {reason}", path.display())]
    Format {
        /// The weights.
        path: PathBuf,
        /// The reader's words.
        reason: String,
    },
    /// A weight that the model needs is not there.
    #[error("{}: tensor `{name}` {expected:?} is missing; there are: {}", path.display(), listed(found))]
    MissingTensor {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Its shape.
        expected: Vec<usize>,
        /// Tensors in the file.
        found: Vec<String>,
    },
    /// A weight that the model does not have.
    #[error("{}: tensor `{name}` belongs to no part of the model; expected: {}", path.display(), listed(expected))]
    UnknownTensor {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Tensors of the model.
        expected: Vec<String>,
    },
    /// A weight of another shape or type.
    #[error("{}: tensor `{name}` is {found}, expected F32 {expected:?}", path.display())]
    Shape {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Type and shape found.
        found: String,
        /// Shape of the model's.
        expected: Vec<usize>,
    },
    /// A weight that is not a number.
    #[error("{}: tensor `{name}` holds {value} at position {index}", path.display())]
    NonFinite {
        /// The weights.
        path: PathBuf,
        /// Its name.
        name: String,
        /// Where, in row-major order.
        index: usize,
        /// What.
        value: f32,
    },
    /// The model could not be built.
    #[error(transparent)]
    Model(#[from] ModelError),
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        "nothing".to_owned()
    } else {
        names.join(", ")
    }
}

/// Names in a folder, sorted; empty where it cannot be read.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A loaded or trained model.
///
/// ```no_run
/// use hydro_plugin::{checkpoint::Checkpoint, model::{EngineKind, Scratch}};
///
/// let checkpoint = Checkpoint::load("models/b1-task2".as_ref())?;
/// let engine = checkpoint.engine(EngineKind::Fused, None)?;
/// let mut force = vec![0.0; engine.outputs()];
/// engine.estimate(&vec![0.0; engine.inputs()], &mut force, &mut Scratch::default());
/// # Ok::<(), hydro_plugin::checkpoint::CheckpointError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// What the model is.
    pub card: Card,
    weights: BTreeMap<String, Tensor>,
}

impl Checkpoint {
    /// From a card and weights by name, checked as on loading.
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
            if !folder.join(name).is_file() {
                return Err(missing(name, names_in(folder)));
            }
        }
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).map_err(|source| CheckpointError::Io { path, source })
        };
        let card = parse_card(&read(CARD)?, &folder.join(CARD))?;
        let path = folder.join(WEIGHTS);
        let bytes = read(WEIGHTS)?;
        let found = hexadecimal(&Sha256::digest(&bytes));
        if found != card.weights_sha256 {
            return Err(CheckpointError::Damaged {
                path,
                bytes: bytes.len(),
                found,
                expected: card.weights_sha256,
            });
        }
        let weights = parse_weights(&bytes, &path)?;
        Self::checked(card, weights, folder)
    }

    /// Writes the folder beside `folder` and renames it; an older checkpoint there is replaced, and stays
    /// whole and in its place until then. What runs that died while saving left beside it is removed.
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
        let partial = parent.join(format!(".{name}.{}.partial", std::process::id()));
        let partial = Partial::new(partial.clone()).map_err(io(&partial))?;
        let new = partial.folder.join("new");
        fs::create_dir_all(&new).map_err(io(&new))?;

        let weights = self.serialise_weights()?;
        let mut card = self.card.clone();
        card.weights_sha256 = hexadecimal(&Sha256::digest(&weights));
        let text = serde_json::to_string_pretty(&card).map_err(|error| CheckpointError::Card {
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

    /// How many numbers the weights hold.
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

    /// The single-step evaluator, with the card's solver or another.
    pub fn engine(
        &self,
        kind: EngineKind,
        solver: Option<Solver>,
    ) -> Result<Box<dyn Engine>, CheckpointError> {
        Ok(self.model(solver)?.engine(kind)?)
    }

    /// Names the content: equal for equal cards and weights, on any machine.
    pub fn digest(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        let mut card = self.card.clone();
        card.weights_sha256.clear();
        // A card is plain data with text keys; it always serialises.
        hash.update(serde_json::to_vec(&card).unwrap_or_default());
        for (name, tensor) in &self.weights {
            hash.update(name);
            for value in numbers(tensor).unwrap_or_default() {
                hash.update(value.to_le_bytes());
            }
        }
        hash.finalize().into()
    }

    fn serialise_weights(&self) -> Result<Vec<u8>, CheckpointError> {
        let mut bytes = Vec::new();
        for (name, tensor) in &self.weights {
            let values: Vec<u8> = numbers(tensor)
                .map_err(ModelError::from)?
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect();
            bytes.push((name, tensor.dims().to_vec(), values));
        }
        let format = |reason: safetensors::SafeTensorError| CheckpointError::Format {
            path: WEIGHTS.into(),
            reason: reason.to_string(),
        };
        let views = bytes
            .iter()
            .map(|(name, shape, values)| {
                Ok((name, TensorView::new(Dtype::F32, shape.clone(), values)?))
            })
            .collect::<Result<Vec<_>, _>>()
            .map_err(format)?;
        safetensors::serialize(views, None).map_err(format)
    }

    fn checked(
        card: Card,
        weights: BTreeMap<String, Tensor>,
        folder: &Path,
    ) -> Result<Self, CheckpointError> {
        check_card(&card, &folder.join(CARD))?;
        let path = folder.join(WEIGHTS);
        // Building the model once with drawn weights names every tensor it has, with its shape.
        let inputs = Encoder::new(card.model.encoding(), &card.features).len();
        let (_, expected) = Parameters::draw(0, |vb| {
            Network::new(&card.model, inputs, card.outputs.len(), vb)
        })
        .map_err(ModelError::from)?;
        let names: BTreeSet<&str> = expected.iter().map(|(name, _)| name).collect();
        for (name, var) in expected.iter() {
            let Some(tensor) = weights.get(name) else {
                return Err(CheckpointError::MissingTensor {
                    path,
                    name: name.to_owned(),
                    expected: var.dims().to_vec(),
                    found: weights.keys().cloned().collect(),
                });
            };
            if tensor.dims() != var.dims() || tensor.dtype() != DType::F32 {
                return Err(CheckpointError::Shape {
                    path,
                    name: name.to_owned(),
                    found: format!("{:?} {:?}", tensor.dtype(), tensor.dims()),
                    expected: var.dims().to_vec(),
                });
            }
            let values = numbers(tensor).map_err(ModelError::from)?;
            if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                return Err(CheckpointError::NonFinite {
                    path,
                    name: name.to_owned(),
                    index,
                    value: values[index],
                });
            }
        }
        if let Some(name) = weights.keys().find(|name| !names.contains(name.as_str())) {
            return Err(CheckpointError::UnknownTensor {
                path,
                name: name.clone(),
                expected: names.into_iter().map(str::to_owned).collect(),
            });
        }
        Ok(Self { card, weights })
    }
}

fn numbers(tensor: &Tensor) -> candle_core::Result<Vec<f32>> {
    tensor.flatten_all()?.to_vec1::<f32>()
}

/// Moves `new` to `folder`. What stood there, if anything, ends up at `new` or at `old`.
fn replace(new: &Path, folder: &Path, old: &Path) -> io::Result<()> {
    if !folder.exists() {
        return fs::rename(new, folder);
    }
    // A folder cannot be renamed over a full one, but the two can change places in one step, so that a
    // process killed at any moment leaves one of them there. Some file systems do not know how.
    exchange(new, folder).or_else(|_| step_aside(new, folder, old))
}

/// Lets two paths change places at once.
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

/// Moves `folder` to `old` and `new` to `folder`; `old` returns if the latter fails.
fn step_aside(new: &Path, folder: &Path, old: &Path) -> io::Result<()> {
    fs::rename(folder, old)?;
    fs::rename(new, folder).inspect_err(|_| {
        // Nothing more can be done if this fails too; the first error is the one to report.
        let _ = fs::rename(old, folder);
    })
}

/// The folder in which a save is prepared, removed with what is left in it, whole or not.
struct Partial {
    folder: PathBuf,
    /// Locked as long as the save runs; the system lets go of the lock of a process that died.
    _lock: Option<fs::File>,
}

impl Partial {
    fn new(folder: PathBuf) -> io::Result<Self> {
        fs::create_dir_all(&folder)?;
        // Where the file system knows no locks the folder passes for abandoned once another save ends.
        let lock = fs::File::open(&folder).ok();
        let lock = lock.filter(|lock| lock.try_lock().is_ok());
        Ok(Self {
            folder,
            _lock: lock,
        })
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // What cannot be removed is hidden by its name; the outcome of the save is already known.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Removes what saves of `name` left in `parent` when they were killed.
fn remove_abandoned(parent: &Path, name: &str) {
    for found in names_in(parent) {
        let process = found
            .strip_prefix(&format!(".{name}."))
            .and_then(|rest| rest.strip_suffix(".partial"));
        if process.is_none_or(|process| process.parse::<u32>().is_err()) {
            continue;
        }
        let folder = parent.join(found);
        let abandoned = fs::File::open(&folder)
            .is_ok_and(|file| !matches!(file.try_lock(), Err(fs::TryLockError::WouldBlock)));
        if abandoned {
            // As in `Partial`: the save itself has succeeded.
            let _ = fs::remove_dir_all(&folder);
        }
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn parse_card(bytes: &[u8], path: &Path) -> Result<Card, CheckpointError> {
    let malformed = |error: serde_json::Error| CheckpointError::Card {
        path: path.to_owned(),
        reason: error.to_string(),
    };
    // The schema first: a card of another version may lack anything else.
    let value: serde_json::Value = serde_json::from_slice(bytes).map_err(malformed)?;
    let schema = value.get("schema");
    if schema.and_then(|schema| schema.as_str()) != Some(SCHEMA) {
        return Err(CheckpointError::Schema {
            path: path.to_owned(),
            found: schema.map_or_else(|| "missing".to_owned(), ToString::to_string),
        });
    }
    serde_json::from_value(value).map_err(malformed)
}

fn check_card(card: &Card, path: &Path) -> Result<(), CheckpointError> {
    let refuse = |reason: String| {
        Err(CheckpointError::Card {
            path: path.to_owned(),
            reason,
        })
    };
    card.model.check()?;
    let inputs = Encoder::new(card.model.encoding(), &card.features).len();
    if card.outputs.is_empty() {
        return refuse("outputs is empty".to_owned());
    }
    if let Some(reason) = card.normaliser.fault(inputs, card.outputs.len()) {
        return refuse(reason);
    }
    if !(card.sample_period.is_finite() && card.sample_period > 0.0) {
        return refuse(format!(
            "sample_period is {} s, expected a positive time",
            card.sample_period
        ));
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
        .or_else(|| frames_fault(&card.frames));
    if let Some(reason) = fault {
        return refuse(reason);
    }
    Ok(())
}

fn parse_weights(bytes: &[u8], path: &Path) -> Result<BTreeMap<String, Tensor>, CheckpointError> {
    let tensors = SafeTensors::deserialize(bytes).map_err(|error| CheckpointError::Format {
        path: path.to_owned(),
        reason: error.to_string(),
    })?;
    tensors
        .iter()
        .map(|(name, view)| {
            if view.dtype() != Dtype::F32 {
                return Err(CheckpointError::Shape {
                    path: path.to_owned(),
                    name: name.to_owned(),
                    found: format!("{:?} {:?}", view.dtype(), view.shape()),
                    expected: view.shape().to_vec(),
                });
            }
            let (words, _) = view.data().as_chunks::<4>();
            let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
            let tensor =
                Tensor::from_vec(values, view.shape(), &Device::Cpu).map_err(ModelError::from)?;
            Ok((name.to_owned(), tensor))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::model::{AttentionOdeConfig, MlpConfig, Scratch};

    fn checkpoint(model: ModelConfig) -> Checkpoint {
        let features = FeatureLayout::floating_base(&["a".into()]).expect("valid");
        let inputs = Encoder::new(model.encoding(), &features).len();
        let outputs = ["force.x", "force.y"].map(str::to_owned).to_vec();
        let (_, weights) =
            Parameters::draw(1, |vb| Network::new(&model, inputs, 2, vb)).expect("drawn");
        let card = Card {
            schema: SCHEMA.to_owned(),
            name: "test".to_owned(),
            feature_units: features
                .features()
                .iter()
                .map(|f| f.unit().to_owned())
                .collect(),
            joints: features.joints(),
            features,
            output_units: vec!["N".to_owned(); 2],
            outputs,
            frames: BTreeMap::from([("wrench".to_owned(), "base".to_owned())]),
            sample_period: 0.01,
            residual: false,
            solver: Solver::Euler,
            normaliser: Normaliser::identity(inputs, 2),
            dataset: None,
            metrics: serde_json::json!({"pooled": 0.1}),
            command: "hydro train".to_owned(),
            hydro: "0.1.0".to_owned(),
            weights_sha256: String::new(),
            model,
        };
        Checkpoint::new(card, weights.snapshot().expect("copied")).expect("valid")
    }

    fn small() -> ModelConfig {
        ModelConfig::AttentionOde(AttentionOdeConfig {
            window: 2,
            heads: 2,
            embedding: 4,
            latent: 3,
            hidden: vec![5],
            ..AttentionOdeConfig::default()
        })
    }

    /// A saved checkpoint in a folder of its own.
    fn saved() -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("model");
        checkpoint(small()).save(&folder).expect("saved");
        (root, folder)
    }

    fn refusal(folder: &Path) -> String {
        Checkpoint::load(folder)
            .expect_err("must be refused")
            .to_string()
    }

    /// Rewrites the card of a saved checkpoint.
    fn edit(folder: &Path, change: impl FnOnce(&mut serde_json::Value)) {
        let path = folder.join(CARD);
        let mut card = serde_json::from_slice(&fs::read(&path).expect("read")).expect("json");
        change(&mut card);
        fs::write(&path, card.to_string()).expect("written");
    }

    /// Replaces the weights, with a card that vouches for them.
    fn replace_weights(folder: &Path, change: impl FnOnce(&mut BTreeMap<String, Tensor>)) {
        let mut checkpoint = Checkpoint::load(folder).expect("whole before");
        change(&mut checkpoint.weights);
        checkpoint.save(folder).expect("saved");
    }

    #[test]
    fn what_was_saved_is_loaded_bit_by_bit() {
        for model in [
            small(),
            ModelConfig::Mlp(MlpConfig {
                hidden: vec![6],
                ..MlpConfig::default()
            }),
        ] {
            let root = tempfile::tempdir().expect("a folder");
            let folder = root.path().join("deep/model");
            let before = checkpoint(model);
            before.save(&folder).expect("saved");
            // Twice: the second replaces the first.
            before.save(&folder).expect("saved again");
            let after = Checkpoint::load(&folder).expect("loaded");
            assert_eq!(before.digest(), after.digest());
            assert_eq!(before.card.model, after.card.model);
            let force = |checkpoint: &Checkpoint| {
                let engine = checkpoint
                    .engine(EngineKind::Fused, None)
                    .expect("an engine");
                let mut force = vec![0.0; 2];
                engine.estimate(
                    &vec![0.3; engine.inputs()],
                    &mut force,
                    &mut Scratch::default(),
                );
                force
            };
            assert_eq!(force(&before), force(&after));
            assert_eq!(
                names_in(&root.path().join("deep")),
                ["model"],
                "nothing else is left behind"
            );
        }
    }

    #[test]
    fn the_digest_tells_weights_and_cards_apart() {
        let one = checkpoint(small());
        let mut other = one.clone();
        other.card.sample_period = 0.02;
        assert_ne!(one.digest(), other.digest());
    }

    #[test]
    fn a_save_that_fails_leaves_the_old_one_whole() {
        let (root, folder) = saved();
        let file = root.path().join("file");
        fs::write(&file, "in the way").expect("written");
        let error = checkpoint(small())
            .save(&file.join("model"))
            .expect_err("its parent is a file");
        assert!(error.to_string().contains("file"), "{error}");
        Checkpoint::load(&folder).expect("still whole");
        assert_eq!(names_in(root.path()), ["file", "model"]);
    }

    #[test]
    fn a_checkpoint_is_in_its_place_at_every_moment_of_its_replacement() {
        let (root, folder) = saved();
        let other = root.path().join("other");
        checkpoint(small()).save(&other).expect("saved");
        if exchange(&other, &folder).is_err() {
            // The file system does not know how; the test of the two renames is all there is.
            return;
        }
        let card = folder.join(CARD);
        let done = AtomicBool::new(false);
        let absent = std::thread::scope(|scope| {
            let watcher = scope.spawn(|| {
                let mut absent = 0;
                while !done.load(Ordering::Relaxed) {
                    absent += usize::from(!card.exists());
                }
                absent
            });
            for _ in 0..20_000 {
                replace(&other, &folder, &root.path().join("old")).expect("replaced");
                let old = root.path().join("old");
                if old.exists() {
                    fs::rename(old, &other).expect("back");
                }
            }
            done.store(true, Ordering::Relaxed);
            watcher.join().expect("no panic")
        });
        assert_eq!(absent, 0, "times that no card was found");
    }

    #[test]
    fn where_folders_cannot_change_places_the_old_one_steps_aside() {
        let (root, folder) = saved();
        let (new, old) = (root.path().join("new"), root.path().join("old"));
        step_aside(&new, &folder, &old).expect_err("there is no new one");
        Checkpoint::load(&folder).expect("back in its place");
        let mut other = checkpoint(small());
        other.card.name = "other".to_owned();
        other.save(&new).expect("saved");
        step_aside(&new, &folder, &old).expect("replaced");
        assert_eq!(Checkpoint::load(&folder).expect("whole").card.name, "other");
        assert_eq!(Checkpoint::load(&old).expect("whole").card.name, "test");
    }

    #[test]
    fn what_dead_runs_left_is_removed_and_nothing_else() {
        let (root, folder) = saved();
        let beside = [
            ".model.1.partial",
            ".model.2.partial",
            ".model.2.3.partial",
            ".model.x.partial",
        ];
        for name in beside {
            fs::create_dir_all(root.path().join(name).join("new")).expect("made");
        }
        let running = Partial::new(root.path().join(beside[1])).expect("locked");
        checkpoint(small()).save(&folder).expect("saved");
        assert_eq!(
            names_in(root.path()),
            [beside[2], beside[1], beside[3], "model"],
            "that of a running save and those of other names stay"
        );
        drop(running);
        assert_eq!(names_in(root.path()), [beside[2], beside[3], "model"]);
    }

    #[test]
    fn a_missing_folder_or_file_lists_what_exists() {
        let (root, folder) = saved();
        let message = refusal(&root.path().join("modle"));
        assert!(
            message.contains("the folder is missing; there are: model"),
            "{message}"
        );
        fs::remove_file(folder.join(WEIGHTS)).expect("removed");
        let message = refusal(&folder);
        assert!(
            message.contains("weights.safetensors is missing; there are: card.json"),
            "{message}"
        );
    }

    #[test]
    fn truncated_and_flipped_weights_are_damaged() {
        let (_root, folder) = saved();
        let path = folder.join(WEIGHTS);
        let whole = fs::read(&path).expect("read");
        fs::write(&path, &whole[..whole.len() - 4]).expect("written");
        assert!(refusal(&folder).contains("is damaged"));
        let mut flipped = whole;
        *flipped.last_mut().expect("not empty") ^= 1;
        fs::write(&path, flipped).expect("written");
        assert!(refusal(&folder).contains("is damaged"));
    }

    #[test]
    fn weights_that_are_no_safetensors_are_refused_even_if_vouched_for() {
        let (_root, folder) = saved();
        fs::write(folder.join(WEIGHTS), b"nonsense").expect("written");
        edit(&folder, |card| {
            card["weights_sha256"] = hexadecimal(&Sha256::digest(b"nonsense")).into()
        });
        assert!(refusal(&folder).contains("not a safetensors file"));
    }

    #[test]
    fn missing_unknown_and_misshapen_tensors_are_named() {
        let (_root, folder) = saved();
        replace_weights(&folder, |weights| {
            weights.remove("field.0.bias");
        });
        let message = refusal(&folder);
        assert!(
            message.contains("tensor `field.0.bias` [5] is missing; there are: attention.lag_bias"),
            "{message}"
        );

        let (_root, folder) = saved();
        replace_weights(&folder, |weights| {
            let extra = weights["field.0.bias"].clone();
            weights.insert("field.9.bias".to_owned(), extra);
        });
        assert!(refusal(&folder).contains("tensor `field.9.bias` belongs to no part of the model"));

        let (_root, folder) = saved();
        replace_weights(&folder, |weights| {
            let swapped = weights["field.1.weight"]
                .t()
                .and_then(|t| t.contiguous())
                .expect("a matrix");
            weights.insert("field.1.weight".to_owned(), swapped);
        });
        let message = refusal(&folder);
        assert!(
            message.contains("tensor `field.1.weight` is F32 [5, 2], expected F32 [2, 5]"),
            "{message}"
        );
    }

    #[test]
    fn a_weight_that_is_not_a_number_is_found() {
        for value in [f32::NAN, f32::INFINITY] {
            let (_root, folder) = saved();
            replace_weights(&folder, |weights| {
                let bad =
                    Tensor::new(&[0.0, 0.0, 0.0, value, 0.0], &Device::Cpu).expect("a vector");
                weights.insert("field.0.bias".to_owned(), bad);
            });
            let message = refusal(&folder);
            assert!(
                message.contains("tensor `field.0.bias` holds") && message.contains("position 3"),
                "{message}"
            );
        }
    }

    #[test]
    fn malformed_cards_say_what_is_wrong() {
        type Change = fn(&mut serde_json::Value);
        let cases: [(Change, &str); 12] = [
            (
                |card| card["schema"] = "hydro-checkpoint/9".into(),
                "schema is \"hydro-checkpoint/9\", expected",
            ),
            (
                |card| card["kind"] = "lstm".into(),
                "unknown variant `lstm`",
            ),
            (
                |card| card["config"]["windw"] = 3.into(),
                "unknown field `windw`",
            ),
            (
                |card| card["config"]["heads"] = 3.into(),
                "embedding 4 is not divisible by 3 heads",
            ),
            (
                |card| card["sample_period"] = 0.0.into(),
                "sample_period is 0 s",
            ),
            (
                |card| card["joints"] = serde_json::json!(["b"]),
                "joints are [\"b\"], but the features name [\"a\"]",
            ),
            (
                |card| card["normaliser"]["output_std"][1] = 0.0.into(),
                "normaliser.output_std[1] is 0",
            ),
            (
                |card| card["features"][0] = "speed".into(),
                "unknown feature `speed`",
            ),
            (
                |card| card["feature_units"] = serde_json::json!([]),
                "feature_units has 0 entries, expected 13",
            ),
            (
                |card| card["feature_units"][0] = "deg".into(),
                "feature_units gives `position.a` in [deg], expected [rad]",
            ),
            (
                |card| card["output_units"][1] = "lbf".into(),
                "output_units gives `force.y` in [lbf], expected [N]",
            ),
            (
                |card| card["frames"]["wrench"] = "world".into(),
                "frames gives `wrench` in \"world\", expected the frame \"base\"",
            ),
        ];
        for (change, expected) in cases {
            let (_root, folder) = saved();
            edit(&folder, change);
            let message = refusal(&folder);
            assert!(message.contains(expected), "{message} lacks {expected}");
        }
        let (_root, folder) = saved();
        fs::write(folder.join(CARD), "{ not json").expect("written");
        assert!(refusal(&folder).contains("card.json"));
    }
}
