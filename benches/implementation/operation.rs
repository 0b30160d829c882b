//! Training by our own operation over the whole trajectory.

use std::time::Instant;

use candle_core::Tensor;
use hydro_model::Adjoint;

use crate::{
    error::Result,
    implementation::{Block, Implementation},
    training_case::{Batch, Drive, TrainingCase},
};

/// Training steps by the operation.
pub(crate) struct Operation(TrainingCase, Adjoint);

impl Operation {
    pub(crate) fn new(case: TrainingCase, adjoint: Adjoint) -> Self {
        Self(case, adjoint)
    }
}

/// F [B, S+1, f].
pub(crate) fn forward(case: &TrainingCase, batch: &Batch, adjoint: Adjoint) -> Result<Tensor> {
    let (model, solver) = (&case.model, case.solver);
    Ok(match &batch.drive {
        Drive::Samples(z) => model.forward(z, &batch.start, solver, adjoint)?,
        Drive::Latents(h) => model.integrate(h, &batch.start, solver, adjoint)?,
    })
}

impl Implementation for Operation {
    fn check(&mut self) -> Result<Vec<f64>> {
        let adjoint = self.1;
        self.0.first(|case, batch| forward(case, batch, adjoint))
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let (case, adjoint) = (&mut self.0, self.1);
        let begin = Instant::now();
        let values = (0..count)
            .map(|_| case.learn(|case, batch| forward(case, batch, adjoint)))
            .collect::<Result<_>>()?;
        Ok(Block {
            seconds: begin.elapsed().as_secs_f64(),
            values,
        })
    }
}
