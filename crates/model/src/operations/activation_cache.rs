//! Activations of the way forward, kept for the way back where memory allows.
//!
//! One slot, shared by the operations of one field: a training step writes it forward and reads it backward, and its
//! memory serves the next step too, for fresh pages are dear. Whose numbers it holds is known by a mark; an operation
//! that finds another's (several forward passes, then one backward) evaluates its own again.

use std::{
    any::Any,
    fmt,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

/// Numbers that are kept at most: 512 MiB in f32.
const MOST: usize = 1 << 27;

/// See the module. Cloning shares the slot.
#[derive(Clone, Default)]
pub(crate) struct ActivationCache(Arc<Mutex<Slot>>);

#[derive(Default)]
struct Slot {
    owner: Option<Mark>,
    /// A `Vec<Vec<T>>`.
    chunks: Option<Box<dyn Any + Send>>,
}

/// Of one call of an operation in this process; the default is nobody's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Mark(u64);

impl Mark {
    /// A new one.
    pub(crate) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Whether so many numbers are kept.
pub(crate) fn worth_keeping(numbers: usize) -> bool {
    numbers <= MOST
}

impl ActivationCache {
    fn with<R>(&self, read: impl FnOnce(&mut Slot) -> R) -> R {
        // A panic elsewhere leaves the slot as whole as before.
        read(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether it holds the numbers of some call.
    #[cfg(test)]
    pub(crate) fn is_owned(&self) -> bool {
        self.with(|slot| slot.owner.is_some())
    }

    /// Memory for `count` chunks, whatever they hold; nobody's from now on.
    pub(crate) fn memory<T: 'static>(&self, count: usize) -> Vec<Vec<T>> {
        let found = self.with(|slot| {
            slot.owner = None;
            slot.chunks.take()
        });
        let chunks = found.and_then(|chunks| chunks.downcast::<Vec<Vec<T>>>().ok());
        let mut chunks = chunks.map(|chunks| *chunks).unwrap_or_default();
        // Chunks of another call may be longer than these, and would stay for ever.
        if !worth_keeping(chunks.iter().map(Vec::capacity).sum()) {
            chunks.clear();
        }
        chunks.resize_with(count, Vec::new);
        chunks
    }

    /// Puts the chunks of an operation there; without one, only their memory.
    pub(crate) fn put<T: Send + 'static>(&self, owner: Option<Mark>, chunks: Vec<Vec<T>>) {
        self.with(|slot| {
            slot.owner = owner;
            slot.chunks = Some(Box::new(chunks));
        });
    }

    /// The chunks of an operation, if they are there.
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
        let (kept, own, other) = (ActivationCache::default(), Mark::new(), Mark::new());
        assert_eq!(kept.take::<f32>(own), None);
        kept.put(Some(own), vec![vec![1.0f32]]);
        assert_eq!(kept.take::<f32>(other), None);
        assert_eq!(kept.take::<f32>(own), Some(vec![vec![1.0]]));
        assert_eq!(kept.take::<f32>(own), None);
        kept.put(Some(own), vec![vec![1.0f32]]);
        // A later operation takes the memory, and the numbers are gone.
        assert_eq!(kept.memory::<f32>(2), [vec![1.0], vec![]]);
        assert_eq!(kept.take::<f32>(own), None);
        kept.put::<f32>(None, vec![vec![2.0]]);
        assert_eq!(kept.memory::<f64>(1), [Vec::<f64>::new()]);
    }
}
