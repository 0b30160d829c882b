//! The attributes that an instance was made from, held against those of the model that it is stepped with.
//!
//! `plugin_data` has an instance's key, and belongs to an `mjData`. `mujoco.batch` and `mujoco.rollout` step data with models
//! of a list: one that says other attributes than the model which the data was made of has another instance.

use std::{
    cell::RefCell,
    collections::{HashMap, HashSet},
    hash::{DefaultHasher, Hasher},
};

use parking_lot::Mutex;
use rustc_hash::FxHashMap;

use crate::{mujoco::ffi::ModelView, plugin::InstanceKey};

/// Models that a thread remembers, and instances whose origins the process remembers; more are looked at anew.
const MOST: usize = 1024;

/// An instance of a model at an address.
type Place = (usize, usize);

thread_local! {
    /// Places that this thread has looked at, with the instance that belongs there: asked several times a step.
    static LOOKED_AT: RefCell<FxHashMap<Place, InstanceKey>> = RefCell::default();
}

/// Digests of the attributes that an instance was made from.
static ORIGINS: Mutex<Option<HashMap<InstanceKey, HashSet<u64>>>> = Mutex::new(None);

fn place(model: ModelView<'_>, id: usize) -> Place {
    (std::ptr::from_ref(model.raw()) as usize, id)
}

fn digest(model: ModelView<'_>, id: usize) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(model.plugin_attributes(id));
    hasher.finish()
}

/// True where the instance of this key was made from the attributes of this model.
pub(super) fn is_of(model: ModelView<'_>, id: usize, key: InstanceKey) -> bool {
    let place = place(model, id);
    if LOOKED_AT.with_borrow(|known| known.get(&place) == Some(&key)) {
        return true;
    }
    let digest = digest(model, id);
    let is_known = {
        let origins = ORIGINS.lock();
        let of_key = origins.as_ref().and_then(|origins| origins.get(&key));
        of_key.is_some_and(|digests| digests.contains(&digest))
    };
    if is_known {
        look_at(place, key);
    }
    is_known
}

/// Remembers that the instance of this key was made from the attributes of this model.
pub(super) fn remember(model: ModelView<'_>, id: usize, key: InstanceKey) {
    let digest = digest(model, id);
    {
        let mut origins = ORIGINS.lock();
        let origins = origins.get_or_insert_default();
        if origins.len() >= MOST && !origins.contains_key(&key) {
            origins.clear();
        }
        origins.entry(key).or_default().insert(digest);
    }
    look_at(place(model, id), key);
}

fn look_at(place: Place, key: InstanceKey) {
    LOOKED_AT.with_borrow_mut(|known| {
        if known.len() >= MOST {
            known.clear();
        }
        known.insert(place, key);
    });
}
