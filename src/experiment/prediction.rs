//! Forces along whole trajectories by whichever way a model has.

use crate::{
    comparison::open_loop::predict_all,
    dataset::Split,
    model::{Engine, EngineKind, ForceModel},
    training::{InitialForce, TrainError, predict_split},
};

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
        if self.model.config.needs_the_future() {
            predict_split(&self.model, split, start)
        } else {
            Ok(predict_all(self.engine.as_ref(), split, start)?)
        }
    }
}
