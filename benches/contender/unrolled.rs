//! Training through Candle's own graph of all steps. Its backward pass calls itself once a node, so the work runs on
//! a thread with a huge stack.

use std::{thread, time::Instant};

use candle_core::Tensor;

use crate::{
    block::{Block, Contender},
    error::Result,
    lesson::{Batch, Drive, Lesson},
    reference::Reference,
};

/// Of the thread, in bytes; only what is touched is ever taken.
const STACK: usize = 4 << 30;

/// See the module.
pub(crate) struct Unrolled(Lesson);

impl Unrolled {
    pub(crate) fn new(lesson: Lesson) -> Self {
        Self(lesson)
    }
}

fn forward(lesson: &Lesson, batch: &Batch) -> Result<Tensor> {
    let model = Reference::new(&lesson.config, &lesson.parameters)?;
    match &batch.drive {
        Drive::Samples(z) => model.integrate(&model.latents(z)?, &batch.start, lesson.solver),
        Drive::Latents(h) => model.integrate(h, &batch.start, lesson.solver),
    }
}

/// Runs `work` where recursion may go deep.
fn deep<T: Send>(work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    thread::scope(|scope| {
        thread::Builder::new()
            .stack_size(STACK)
            .spawn_scoped(scope, work)?
            .join()
            .map_err(|_| "the thread panicked")?
    })
}

impl Contender for Unrolled {
    fn check(&mut self) -> Result<Vec<f64>> {
        deep(|| self.0.first(forward))
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let lesson = &mut self.0;
        deep(move || {
            let begin = Instant::now();
            let values = (0..count)
                .map(|_| lesson.learn(forward))
                .collect::<Result<_>>()?;
            Ok(Block {
                seconds: begin.elapsed().as_secs_f64(),
                values,
            })
        })
    }
}
