//! Training by our own operation over the whole trajectory.

use std::time::Instant;

use candle_core::Tensor;
use hydro_model::Adjoint;

use crate::{
    block::{Block, Contender},
    error::Result,
    lesson::{Batch, Drive, Lesson},
};

/// See the module.
pub(crate) struct Ours(Lesson, Adjoint);

impl Ours {
    pub(crate) fn new(lesson: Lesson, adjoint: Adjoint) -> Self {
        Self(lesson, adjoint)
    }
}

/// F [B, S+1, f].
pub(crate) fn forward(lesson: &Lesson, batch: &Batch, adjoint: Adjoint) -> Result<Tensor> {
    let (model, solver) = (&lesson.model, lesson.solver);
    Ok(match &batch.drive {
        Drive::Samples(z) => model.forward(z, &batch.start, solver, adjoint)?,
        Drive::Latents(h) => model.integrate(h, &batch.start, solver, adjoint)?,
    })
}

impl Contender for Ours {
    fn check(&mut self) -> Result<Vec<f64>> {
        let adjoint = self.1;
        self.0
            .first(|lesson, batch| forward(lesson, batch, adjoint))
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let (lesson, adjoint) = (&mut self.0, self.1);
        let begin = Instant::now();
        let values = (0..count)
            .map(|_| lesson.learn(|lesson, batch| forward(lesson, batch, adjoint)))
            .collect::<Result<_>>()?;
        Ok(Block {
            seconds: begin.elapsed().as_secs_f64(),
            values,
        })
    }
}
