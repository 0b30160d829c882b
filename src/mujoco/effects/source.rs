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
