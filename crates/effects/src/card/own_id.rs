//! Names of the user's own effects, of as many as this process has been told of.

use std::sync::{Mutex, OnceLock, PoisonError};

/// Prefix of the names of the user's own effects.
pub const OWN_PREFIX: &str = "user.";

/// Most definitions of a process. They stay to its end.
pub(crate) const MOST_OWN: usize = 1024;

/// Name of one of the user's own effects. Two definitions of one name are two effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OwnId(u16);

/// Names by number, with the prefix.
static NAMES: [OnceLock<String>; MOST_OWN] = [const { OnceLock::new() }; MOST_OWN];

/// All, the one told of last at the end.
static KNOWN: Mutex<Vec<OwnId>> = Mutex::new(Vec::new());

impl OwnId {
    /// The id of the definition of a number, below [`MOST_OWN`]; `None` for another.
    pub(crate) fn new(number: usize, name: &str) -> Option<Self> {
        NAMES
            .get(number)?
            .get_or_init(|| format!("{OWN_PREFIX}{name}"));
        u16::try_from(number).ok().map(Self)
    }

    /// The spelling in files, with the prefix.
    pub fn as_str(self) -> &'static str {
        let name = NAMES.get(self.number()).and_then(OnceLock::get);
        name.map_or(OWN_PREFIX, String::as_str)
    }

    /// Place of its definition among all.
    pub(crate) fn number(self) -> usize {
        usize::from(self.0)
    }

    /// Makes it the one that a file means by the name.
    pub(crate) fn announce(self) {
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|of| *of != self);
        known.push(self);
    }

    /// The latest of a name.
    pub(crate) fn latest(name: &str) -> Option<Self> {
        let known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        known.iter().rev().find(|of| of.as_str() == name).copied()
    }
}
