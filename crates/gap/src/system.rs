//! A plant under a hypothesis: nuisance parameters turned and effects added.

use hydro_effects::Entry;

use super::{error::GapError, shooting::WarmUp};
use crate::plant::{Plant, PlantDescription, Simulation};

/// What is simulated.
#[derive(Clone)]
pub(super) struct System<'a> {
    pub(super) plant: &'a dyn Plant,
    /// One for each of the plant's.
    pub(super) nuisances: Vec<f64>,
    pub(super) entries: Vec<Entry>,
}

impl<'a> System<'a> {
    /// The plant as it is.
    pub(super) fn plain(plant: &'a dyn Plant) -> Self {
        Self {
            plant,
            nuisances: vec![0.0; plant.description().nuisances.len()],
            entries: Vec::new(),
        }
    }

    pub(super) fn model(&self) -> &'a PlantDescription {
        self.plant.description()
    }

    pub(super) fn simulation(&self) -> Result<Box<dyn Simulation>, GapError> {
        Ok(self.plant.simulation(&self.nuisances, &self.entries)?)
    }

    /// With a cheaper integrator, for differences; the same where there is none.
    pub(super) fn cheaper(&self) -> Result<Box<dyn Simulation>, GapError> {
        let plant = self.plant.cheaper().unwrap_or(self.plant);
        Ok(plant.simulation(&self.nuisances, &self.entries)?)
    }

    pub(super) fn warm_up(&self) -> WarmUp {
        WarmUp::of(self.model(), &self.entries)
    }
}
