//! What every contender does.

use crate::error::Result;

/// A timed piece of work.
pub(crate) struct Block {
    pub(crate) seconds: f64,
    /// What the work gave, where it gives numbers worth comparing: the losses of training steps.
    pub(crate) values: Vec<f64>,
}

impl Block {
    /// Without numbers.
    pub(crate) fn timed(seconds: f64) -> Self {
        Self {
            seconds,
            values: Vec::new(),
        }
    }
}

/// One way to do a task.
pub(crate) trait Contender {
    /// Numbers that every contender of the task computes alike; not timed.
    fn check(&mut self) -> Result<Vec<f64>>;

    /// The work, `count` times.
    fn block(&mut self, count: usize) -> Result<Block>;
}
