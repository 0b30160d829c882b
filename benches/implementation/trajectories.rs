//! Forces of whole trajectories, without gradients.

use std::{hint::black_box, time::Instant};

use hydro_model::Adjoint;

use crate::{
    error::Result,
    implementation::{Block, Implementation},
    operation::forward,
    training_case::TrainingCase,
};

/// The first `batch` trajectories of a case, again and again where it has fewer.
pub(crate) struct Trajectories {
    case: TrainingCase,
    batch: usize,
}

impl Trajectories {
    pub(crate) fn new(case: TrainingCase, batch: usize) -> Self {
        Self { case, batch }
    }

    fn chosen(&self) -> Vec<u32> {
        let known = self.case.trajectories() as u32;
        (0..self.batch as u32).map(|index| index % known).collect()
    }
}

impl Implementation for Trajectories {
    /// The last force of the first trajectory.
    fn check(&mut self) -> Result<Vec<f64>> {
        let forces = forward(
            &self.case,
            &self.case.gather(&self.chosen())?,
            Adjoint::default(),
        )?;
        let forces = forces.get(0)?;
        let last: Vec<f32> = forces.get(forces.dim(0)? - 1)?.to_vec1()?;
        Ok(last.into_iter().map(f64::from).collect())
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let batch = self.case.gather(&self.chosen())?;
        let begin = Instant::now();
        for _ in 0..count {
            black_box(forward(&self.case, black_box(&batch), Adjoint::default())?);
        }
        Ok(Block::timed(begin.elapsed().as_secs_f64()))
    }
}
