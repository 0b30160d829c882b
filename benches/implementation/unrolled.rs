//! Training through Candle's own graph of all steps. Its backward pass calls itself once a node, so the work runs on
//! a thread with a huge stack.

use std::{thread, time::Instant};

use candle_core::Tensor;

use crate::{
    error::Result,
    implementation::{Block, Implementation},
    plain_model::PlainModel,
    training_case::{Batch, Drive, TrainingCase},
};

/// Stack of the thread [bytes]; the system gives only the pages that are used.
const STACK: usize = 4 << 30;

/// Training steps through the unrolled graph.
pub(crate) struct Unrolled(TrainingCase);

impl Unrolled {
    pub(crate) fn new(case: TrainingCase) -> Self {
        Self(case)
    }
}

fn forward(case: &TrainingCase, batch: &Batch) -> Result<Tensor> {
    let model = PlainModel::new(&case.config, &case.parameters)?;
    match &batch.drive {
        Drive::Samples(z) => model.integrate(&model.latents(z)?, &batch.start, case.solver),
        Drive::Latents(h) => model.integrate(h, &batch.start, case.solver),
    }
}

/// Runs `work` on a thread with a stack for deep recursion.
fn deep<T: Send>(work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    thread::scope(|scope| {
        thread::Builder::new()
            .stack_size(STACK)
            .spawn_scoped(scope, work)?
            .join()
            .map_err(|_| "the thread panicked")?
    })
}

impl Implementation for Unrolled {
    fn check(&mut self) -> Result<Vec<f64>> {
        deep(|| self.0.first(forward))
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let case = &mut self.0;
        deep(move || {
            let begin = Instant::now();
            let values = (0..count)
                .map(|_| case.learn(forward))
                .collect::<Result<_>>()?;
            Ok(Block {
                seconds: begin.elapsed().as_secs_f64(),
                values,
            })
        })
    }
}
