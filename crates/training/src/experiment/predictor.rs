//! Forces along whole trajectories, by engine or by network as the model needs.

use hydro_model::{Engine, EngineKind, ForceModel};

use crate::{
    TrainError,
    dataset::Split,
    metrics::{InitialForce, predict_by_engine, predict_by_network},
};

/// Standard deviations beyond which a force counts as that far off: one that is infinite or no number is lost, and its
/// errors shall be large and not unreadable.
const LOST: f64 = 1e9;

/// A model and its engine.
pub(super) struct Predictor {
    model: ForceModel,
    engine: Box<dyn Engine>,
}

impl Predictor {
    pub(super) fn new(model: ForceModel) -> Result<Self, TrainError> {
        let engine = model.engine(EngineKind::Fused)?;
        Ok(Self { model, engine })
    }

    pub(super) fn model(&self) -> &ForceModel {
        &self.model
    }

    /// `[M][T * f]`, SI. By the engine, as in a simulation; a model that needs samples to come has the whole trajectory, as in
    /// the paper.
    pub(super) fn forces(
        &self,
        split: &Split,
        start: InitialForce,
    ) -> Result<Vec<Vec<f64>>, TrainError> {
        let mut forces = if self.model.config.needs_the_future() {
            predict_by_network(&self.model, split, start)?
        } else {
            predict_by_engine(self.engine.as_ref(), split, start)?
        };
        let std = &self.model.normaliser.output_std;
        for row in forces
            .iter_mut()
            .flat_map(|all| all.chunks_exact_mut(std.len()))
        {
            for (force, std) in row.iter_mut().zip(std) {
                *force = held(*force, LOST * std);
            }
        }
        Ok(forces)
    }
}

/// A force within `bound`; what is no number is on it.
fn held(force: f64, bound: f64) -> f64 {
    if force.is_nan() {
        bound
    } else {
        force.clamp(-bound, bound)
    }
}

#[cfg(test)]
#[path = "tests/predictor.rs"]
mod tests;
