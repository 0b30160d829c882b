//! Progress of a long stage, and the request to stop it.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::error::GapError;

/// Who watches a stage.
pub struct Watch<'a> {
    /// Set from outside: stop at the next chance.
    pub stop: &'a AtomicBool,
    /// Called with what is done, how much of it, and how much there is.
    pub tell: &'a (dyn Fn(&str, usize, usize) + Sync),
}

impl std::fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").finish_non_exhaustive()
    }
}

impl<'a> Watch<'a> {
    /// One that is told nothing.
    pub fn silent(stop: &'a AtomicBool) -> Self {
        Self {
            stop,
            tell: &|_, _, _| {},
        }
    }

    /// An error where a stop was asked for.
    pub(crate) fn check(&self) -> Result<(), GapError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(GapError::Stopped);
        }
        Ok(())
    }

    /// Counts one more piece of `total` done.
    pub(crate) fn count(&self, what: &str, done: &AtomicUsize, total: usize) {
        (self.tell)(what, done.fetch_add(1, Ordering::Relaxed) + 1, total);
    }
}
