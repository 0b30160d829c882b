//! Loaded checkpoints and instances, shared by the whole process.
//!
//! `plugin_data` holds only an [`InstanceKey`]: a hash of what the instance is made of. MuJoCo may copy
//! it verbatim, into another `mjData` or (by pickling) another process; a key that is not known there is
//! made good from the attributes. Counts only decide what may be forgotten: a wrong one costs a reload.

use std::{
    collections::{HashMap, HashSet},
    fs,
    hash::Hash,
    num::NonZeroU64,
    path::{Path, PathBuf},
    sync::{
        Arc, Weak,
        atomic::{AtomicU64, Ordering},
    },
    time::SystemTime,
};

use hydro_model::{
    Engine, EngineKind, Solver,
    checkpoint::{Checkpoint, CheckpointError},
    document::hexadecimal,
};
use parking_lot::{Mutex, RwLock};
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::{
    attribute_error::AttributeError,
    attributes::Settings,
    body::{Body, BodyError},
    bound::{Afloat, Bound},
    instance::Instance,
    learned_wrench::LearnedWrench,
};

/// Instances without an `mjData` that are kept, so that making one again loads nothing.
const MOST_IDLE: usize = 8;

/// Checkpoints that no instance uses and that are kept: between the making of a model and of its first data nobody uses one.
const MOST_UNUSED: usize = 2;

/// Why an instance could not be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SetupError {
    /// A fault of an attribute.
    #[error(transparent)]
    Attribute(#[from] AttributeError),
    /// The card does not fit the model.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The checkpoint does not load.
    #[error("checkpoint {}: {source}", .path.display())]
    Checkpoint {
        /// Its folder.
        path: PathBuf,
        /// Fault of the checkpoint.
        #[source]
        source: Box<CheckpointError>,
    },
}

/// Hash of an instance's content; what `plugin_data` holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct InstanceKey(NonZeroU64);

impl InstanceKey {
    fn hash(parts: &[&str]) -> Self {
        let mut hasher = Sha256::new();
        for part in parts {
            hasher.update((part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
        let digest = hasher.finalize();
        let mut first = [0; 8];
        first.copy_from_slice(&digest[..8]);
        Self(NonZeroU64::new(u64::from_le_bytes(first)).unwrap_or(NonZeroU64::MIN))
    }

    /// The key in a number of `plugin_data`; `None` for 0, an instance that was never made.
    pub fn from_bits(bits: u64) -> Option<Self> {
        NonZeroU64::new(bits).map(Self)
    }

    /// The number that `plugin_data` holds.
    pub fn to_bits(self) -> u64 {
        self.0.get()
    }
}

/// Time and size of the two files of a checkpoint: a cheap sign that they were replaced.
type Stamp = Vec<Option<(SystemTime, u64)>>;

type EngineKey = (String, EngineKind, Option<Solver>);

/// A checkpoint, with the hash of its content taken once.
#[derive(Debug)]
pub struct Loaded {
    /// The checkpoint.
    pub checkpoint: Checkpoint,
    digest: String,
}

/// A checkpoint as it was when it was last looked for.
#[derive(Debug)]
struct Known {
    stamp: Stamp,
    loaded: Arc<Loaded>,
    /// Number of the last look.
    looked: u64,
}

#[derive(Debug)]
struct Held {
    instance: Arc<Instance>,
    users: usize,
    /// Value of the clock when it was last let go; the smallest idle one is forgotten first.
    idle_since: u64,
}

#[derive(Debug, Default)]
struct Instances {
    held: HashMap<InstanceKey, Held>,
    clock: u64,
}

/// The cache. One stands in the process: [`Registry::global`].
#[derive(Debug, Default)]
pub struct Registry {
    checkpoints: Mutex<HashMap<PathBuf, Known>>,
    /// Number of looks for a checkpoint so far.
    looks: AtomicU64,
    engines: Mutex<HashMap<EngineKey, Weak<dyn Engine>>>,
    instances: RwLock<Instances>,
    /// Number of instances forgotten so far.
    forgotten: AtomicU64,
}

impl Registry {
    /// The process's own.
    pub fn global() -> &'static Self {
        static REGISTRY: std::sync::LazyLock<Registry> =
            std::sync::LazyLock::new(Registry::default);
        &REGISTRY
    }

    /// The checkpoint of a folder, loaded once while its files stay the same.
    pub fn checkpoint(&self, folder: &Path) -> Result<Arc<Loaded>, SetupError> {
        let key = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let stamp = stamp(&key);
        {
            let mut known = self.checkpoints.lock();
            if let Some(known) = known.get_mut(&key)
                && known.stamp == stamp
            {
                known.looked = self.looks.fetch_add(1, Ordering::Relaxed);
                return Ok(Arc::clone(&known.loaded));
            }
        }
        let checkpoint = Checkpoint::load(&key).map_err(|source| SetupError::Checkpoint {
            path: key.clone(),
            source: Box::new(source),
        })?;
        let digest = hexadecimal(&checkpoint.digest());
        let loaded = Arc::new(Loaded { checkpoint, digest });
        let known = Known {
            stamp,
            loaded: Arc::clone(&loaded),
            looked: self.looks.fetch_add(1, Ordering::Relaxed),
        };
        self.checkpoints.lock().insert(key, known);
        self.forget_unused();
        Ok(loaded)
    }

    /// Forgets the checkpoints that no instance uses, but for the last few that were looked for.
    fn forget_unused(&self) {
        let known = self.checkpoints.lock();
        if known.len() <= MOST_UNUSED {
            return;
        }
        drop(known);
        let used: HashSet<PathBuf> = {
            let instances = self.instances.read();
            let folders = (instances.held.values())
                .filter(|held| held.users > 0)
                .filter_map(|held| held.instance.settings().checkpoint.clone());
            folders
                .map(|folder| folder.canonicalize().unwrap_or(folder))
                .collect()
        };
        let mut known = self.checkpoints.lock();
        let mut unused: Vec<(u64, PathBuf)> = known
            .iter()
            .filter(|(folder, _)| !used.contains(*folder))
            .map(|(folder, known)| (known.looked, folder.clone()))
            .collect();
        unused.sort_unstable();
        let surplus = unused.len().saturating_sub(MOST_UNUSED);
        for (_, folder) in &unused[..surplus] {
            known.remove(folder);
        }
    }

    /// Makes (or finds) the instance of these settings on this body, with its effects tied to the model,
    /// and counts one more user.
    pub fn acquire(
        &self,
        settings: Settings,
        body: &Body,
        effects: Option<Bound>,
        afloat: Afloat,
    ) -> Result<(InstanceKey, Arc<Instance>), SetupError> {
        let loaded = match &settings.checkpoint {
            Some(folder) => Some(self.checkpoint(folder)?),
            None => None,
        };
        let key = InstanceKey::hash(&[
            loaded.as_ref().map_or("", |loaded| &loaded.digest),
            &format!("{settings:?}"),
            &format!("{body:?}"),
            &format!("{effects:?}"),
            &format!("{afloat:?}"),
        ]);
        {
            let mut instances = self.instances.write();
            if let Some(held) = instances.held.get_mut(&key) {
                held.users += 1;
                return Ok((key, Arc::clone(&held.instance)));
            }
        }
        let learned = match loaded {
            Some(loaded) => {
                let engine = self.engine(&loaded, &settings)?;
                let checkpoint = &loaded.checkpoint;
                Some(LearnedWrench::new(
                    settings.clone(),
                    checkpoint,
                    engine,
                    body,
                )?)
            }
            None => None,
        };
        let instance = Arc::new(Instance::new(settings, learned, effects, afloat));
        let mut instances = self.instances.write();
        let fresh = Held {
            instance,
            users: 0,
            idle_since: 0,
        };
        let held = instances.held.entry(key).or_insert(fresh);
        held.users += 1;
        Ok((key, Arc::clone(&held.instance)))
    }

    /// The instance of a key, where this process has made it.
    pub fn get(&self, key: InstanceKey) -> Option<Arc<Instance>> {
        let instances = self.instances.read();
        instances
            .held
            .get(&key)
            .map(|held| Arc::clone(&held.instance))
    }

    /// Number of instances forgotten so far: while it stays the same, a handle stays valid.
    pub fn forgotten(&self) -> u64 {
        self.forgotten.load(Ordering::Acquire)
    }

    /// Counts one user less; of the instances without users the latest few are kept.
    pub fn release(&self, key: InstanceKey) {
        let mut instances = self.instances.write();
        instances.clock += 1;
        let now = instances.clock;
        if let Some(held) = instances.held.get_mut(&key) {
            held.users = held.users.saturating_sub(1);
            held.idle_since = now;
        }
        let mut idle: Vec<(u64, InstanceKey)> = instances
            .held
            .iter()
            .filter(|(_, held)| held.users == 0)
            .map(|(key, held)| (held.idle_since, *key))
            .collect();
        idle.sort_unstable_by_key(|(since, _)| *since);
        let surplus = idle.len().saturating_sub(MOST_IDLE);
        for (_, key) in &idle[..surplus] {
            instances.held.remove(key);
            self.forgotten.fetch_add(1, Ordering::Release);
        }
        drop(instances);
        self.forget_unused();
    }

    /// The network of a checkpoint as the settings ask for it, shared while anybody uses it.
    pub fn engine(
        &self,
        loaded: &Loaded,
        settings: &Settings,
    ) -> Result<Arc<dyn Engine>, SetupError> {
        let key = (loaded.digest.clone(), settings.engine, settings.solver);
        let known = |engines: &HashMap<EngineKey, Weak<dyn Engine>>| {
            engines.get(&key).and_then(Weak::upgrade)
        };
        if let Some(engine) = known(&self.engines.lock()) {
            return Ok(engine);
        }
        let engine = loaded
            .checkpoint
            .engine(settings.engine, settings.solver)
            .map_err(|source| SetupError::Checkpoint {
                path: settings.checkpoint.clone().unwrap_or_default(),
                source: Box::new(source),
            })?;
        let engine: Arc<dyn Engine> = Arc::from(engine);
        let mut engines = self.engines.lock();
        engines.retain(|_, engine| engine.strong_count() > 0);
        engines.insert(key, Arc::downgrade(&engine));
        Ok(engine)
    }
}

fn stamp(folder: &Path) -> Stamp {
    ["card.json", "weights.safetensors"]
        .iter()
        .map(|name| {
            let about = fs::metadata(folder.join(name)).ok()?;
            Some((about.modified().ok()?, about.len()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_checkpoint_that_nobody_uses_is_forgotten() {
        let registry = Registry::default();
        let root = tempfile::tempdir().unwrap();
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/b1-task2");
        let mut seen = Vec::new();
        for number in 0..5 {
            let folder = root.path().join(number.to_string());
            fs::create_dir(&folder).unwrap();
            for name in ["card.json", "weights.safetensors"] {
                fs::copy(source.join(name), folder.join(name)).unwrap();
            }
            let loaded = registry.checkpoint(&folder).unwrap();
            assert!(Arc::ptr_eq(&loaded, &registry.checkpoint(&folder).unwrap()));
            seen.push(Arc::downgrade(&loaded));
        }
        let kept = seen.iter().filter(|loaded| loaded.upgrade().is_some());
        assert_eq!(kept.count(), MOST_UNUSED);
        assert!(seen[4].upgrade().is_some(), "the last one is kept");
    }
}
