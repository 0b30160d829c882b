//! Effects with their memory.

use crate::plugin::Bound;

/// Effects of one plugin instance, or of one simulation of `hydro gap`, with their memory.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) bound: &'a Bound,
    pub(crate) memory: &'a [f64],
    /// True where commands were changed before the step, so that `ctrl` has what arrives.
    pub(crate) commands_arrived: bool,
}

impl Source<'_> {
    /// The memory of its sea: the last numbers, also where the model was compiled for more than its effects need now.
    pub(super) fn sea_memory(&self) -> &[f64] {
        let first = sea_memory_start(self.bound, self.memory);
        &self.memory[first..]
    }
}

/// Place in the memory of all at which that of the sea begins.
pub(super) fn sea_memory_start(bound: &Bound, memory: &[f64]) -> usize {
    memory.len().saturating_sub(bound.sea.memory_len())
}
