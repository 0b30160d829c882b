//! Training by our own operation over the whole trajectory.

use std::time::Instant;

use candle_core::Tensor;

use crate::{
    block::{Block, Contender},
    error::Result,
    lesson::{Batch, Drive, Lesson},
};

/// See the module.
pub(crate) struct Ours(Lesson);

impl Ours {
    pub(crate) fn new(lesson: Lesson) -> Self {
        Self(lesson)
    }
}

/// F [B, S+1, f].
pub(crate) fn forward(lesson: &Lesson, batch: &Batch) -> Result<Tensor> {
    let (model, solver) = (&lesson.model, lesson.solver);
    Ok(match &batch.drive {
        Drive::Samples(z) => model.forward(z, &batch.start, solver)?,
        Drive::Latents(h) => model.integrate(h, &batch.start, solver)?,
    })
}

impl Contender for Ours {
    fn check(&mut self) -> Result<Vec<f64>> {
        self.0.first(forward)
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let begin = Instant::now();
        let values = (0..count)
            .map(|_| self.0.learn(forward))
            .collect::<Result<_>>()?;
        Ok(Block {
            seconds: begin.elapsed().as_secs_f64(),
            values,
        })
    }
}
