//! Cache of the activations of a forward pass for the backward pass, where memory allows.
//!
//! The operations of one field share one slot. A training step writes it in its forward pass and reads it in its backward
//! pass; the memory is reused by the next step, because fresh pages are slow. A mark names the call whose activations the
//! slot holds; an operation that finds another mark (several forward passes before a backward one) evaluates its own
//! activations again.

use std::{
    any::Any,
    fmt,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

/// Greatest number of activations in the cache: 512 MiB in f32.
const CAPACITY: usize = 1 << 27;

/// The slot. Clones share it.
#[derive(Clone, Default)]
pub(crate) struct ActivationCache(Arc<Mutex<Slot>>);

#[derive(Default)]
struct Slot {
    owner: Option<Mark>,
    /// A `Vec<Vec<T>>`.
    chunks: Option<Box<dyn Any + Send>>,
}

/// Identifies one call of an operation in this process; the default belongs to no call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Mark(u64);

impl Mark {
    /// A mark that no other call has.
    pub(crate) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// True if so many activations are cached.
pub(crate) fn fits(numbers: usize) -> bool {
    numbers <= CAPACITY
}

impl ActivationCache {
    fn with<R>(&self, read: impl FnOnce(&mut Slot) -> R) -> R {
        // A panic elsewhere leaves the slot as whole as before.
        read(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// True if it holds the activations of a call.
    #[cfg(test)]
    pub(crate) fn is_owned(&self) -> bool {
        self.with(|slot| slot.owner.is_some())
    }

    /// Memory for `count` chunks of arbitrary content; afterwards the slot is empty.
    pub(crate) fn memory<T: 'static>(&self, count: usize) -> Vec<Vec<T>> {
        let found = self.with(|slot| {
            slot.owner = None;
            slot.chunks.take()
        });
        let chunks = found.and_then(|chunks| chunks.downcast::<Vec<Vec<T>>>().ok());
        let mut chunks = chunks.map(|chunks| *chunks).unwrap_or_default();
        // Chunks left by a larger call would otherwise never be freed.
        if !fits(chunks.iter().map(Vec::capacity).sum()) {
            chunks.clear();
        }
        chunks.resize_with(count, Vec::new);
        chunks
    }

    /// Stores the chunks of the call `owner`, or only their memory if there is none.
    pub(crate) fn put<T: Send + 'static>(&self, owner: Option<Mark>, chunks: Vec<Vec<T>>) {
        self.with(|slot| {
            slot.owner = owner;
            slot.chunks = Some(Box::new(chunks));
        });
    }

    /// Takes the chunks of the call `owner`, if the slot holds them.
    pub(crate) fn take<T: 'static>(&self, owner: Mark) -> Option<Vec<Vec<T>>> {
        let found = self.with(|slot| {
            (slot.owner == Some(owner)).then(|| {
                slot.owner = None;
                slot.chunks.take()
            })
        });
        Some(*found??.downcast().ok()?)
    }
}

impl fmt::Debug for ActivationCache {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActivationCache")
            .field("owner", &self.with(|slot| slot.owner))
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_found_by_their_owner_once_and_nobody_else() {
        let (cache, own, other) = (ActivationCache::default(), Mark::new(), Mark::new());
        assert_eq!(cache.take::<f32>(own), None);
        cache.put(Some(own), vec![vec![1.0f32]]);
        assert_eq!(cache.take::<f32>(other), None);
        assert_eq!(cache.take::<f32>(own), Some(vec![vec![1.0]]));
        assert_eq!(cache.take::<f32>(own), None);
        cache.put(Some(own), vec![vec![1.0f32]]);
        // A later operation takes the memory, and the numbers are gone.
        assert_eq!(cache.memory::<f32>(2), [vec![1.0], vec![]]);
        assert_eq!(cache.take::<f32>(own), None);
        cache.put::<f32>(None, vec![vec![2.0]]);
        assert_eq!(cache.memory::<f64>(1), [Vec::<f64>::new()]);
    }
}
