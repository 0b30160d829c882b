//! All definitions that this process was told of. The same definition under the same name is one effect.

use std::{
    collections::BTreeMap,
    sync::{Mutex, OnceLock, PoisonError},
};

use super::{
    definition::Definition,
    effect::OwnEffect,
    error::OwnError,
    source::{LARGEST_FILE, Source},
};
use crate::{
    Effect, Id,
    card::{MOST_OWN, OWN_PREFIX, OwnId},
};

/// Definitions by number.
static TABLE: [OnceLock<Box<OwnEffect>>; MOST_OWN] = [const { OnceLock::new() }; MOST_OWN];

/// Ids by name and text.
static KNOWN: Mutex<BTreeMap<(String, String), OwnId>> = Mutex::new(BTreeMap::new());

/// The effect of an id.
pub(crate) fn effect(id: OwnId) -> &'static dyn Effect {
    // An id is given out after its place is filled; a place that is not is an effect that does nothing.
    TABLE[id.number() % MOST_OWN]
        .get_or_init(|| Box::new(OwnEffect::idle(id)))
        .as_ref()
}

/// Checks the text of `NAME.toml` and makes it the effect `user.NAME`.
///
/// # Errors
/// The first fault of the file, with its place.
pub fn register_toml(name: &str, text: &str) -> Result<Id, OwnError> {
    register(name, Source::from_toml(text)?)
}

/// The same of a [`crate::Effect::definition`], under its whole name, `user.NAME`.
///
/// # Errors
/// The first fault, with its place.
pub fn register_json(id: &str, definition: &serde_json::Value) -> Result<Id, OwnError> {
    let name = id
        .strip_prefix(OWN_PREFIX)
        .ok_or_else(|| OwnError::Format {
            what: format!("only an effect `{OWN_PREFIX}NAME` has a definition, and this is `{id}`"),
        })?;
    register(name, Source::from_json(definition)?)
}

fn register(name: &str, source: Source) -> Result<Id, OwnError> {
    let text = source.to_json()?;
    if text.len() as u64 > LARGEST_FILE {
        return Err(OwnError::TooMuch {
            what: "bytes of the definition".to_owned(),
            found: text.len(),
            most: LARGEST_FILE as usize,
        });
    }
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let key = (name.to_owned(), text);
    if let Some(id) = known.get(&key) {
        id.announce();
        return Ok(Id::Own(*id));
    }
    let definition = Definition::new(name, source)?;
    let number = known.len();
    let full = || OwnError::TooManyDefinitions { most: MOST_OWN };
    let place = TABLE.get(number).ok_or_else(full)?;
    let id = OwnId::new(number, name).ok_or_else(full)?;
    let text = key.1.clone();
    place.get_or_init(|| Box::new(OwnEffect::new(id, definition, text)));
    known.insert(key, id);
    id.announce();
    Ok(Id::Own(id))
}
