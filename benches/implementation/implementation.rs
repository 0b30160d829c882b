//! The interface of an implementation.

use crate::error::Result;

/// A timed piece of work.
pub(crate) struct Block {
    pub(crate) seconds: f64,
    /// Results to compare: the losses of training steps; else empty.
    pub(crate) values: Vec<f64>,
}

impl Block {
    /// A block without results.
    pub(crate) fn timed(seconds: f64) -> Self {
        Self {
            seconds,
            values: Vec::new(),
        }
    }
}

/// One way to do a task.
pub(crate) trait Implementation {
    /// Numbers that must be the same for every implementation of the task; not timed.
    fn check(&mut self) -> Result<Vec<f64>>;

    /// The work, `count` times.
    fn block(&mut self, count: usize) -> Result<Block>;
}
