//! A plant under a hypothesis: nuisance parameters turned and effects added.

use hydro_effects::Entry;

use crate::{
    error::GapError,
    options::RolloutOptions,
    plant::{Plant, PlantDescription, Simulation},
    rollout::shooting::WarmUp,
};

/// A plant with values of its nuisance parameters and added effects.
#[derive(Clone)]
pub(crate) struct System<'a> {
    pub(crate) plant: &'a dyn Plant,
    /// One for each of the plant's.
    pub(crate) nuisances: Vec<f64>,
    pub(crate) entries: Vec<Entry>,
}

impl<'a> System<'a> {
    /// The plant as it is.
    pub(crate) fn plain(plant: &'a dyn Plant) -> Self {
        Self {
            plant,
            nuisances: vec![0.0; plant.description().nuisances.len()],
            entries: Vec::new(),
        }
    }

    /// The plant as it is, on logs with this number for what came before them ([`crate::plant::Quantity::CommandsBefore`]).
    pub(crate) fn of_logs(plant: &'a dyn Plant, commands_before: f64) -> Self {
        let mut plain = Self::plain(plant);
        if let Some(at) = plant.description().commands_before() {
            plain.nuisances[at] = commands_before;
        }
        plain
    }

    pub(crate) fn model(&self) -> &'a PlantDescription {
        self.plant.description()
    }

    pub(crate) fn simulation(&self) -> Result<Box<dyn Simulation>, GapError> {
        Ok(self.plant.simulation(&self.nuisances, &self.entries)?)
    }

    /// With a cheaper integrator, for differences; the same where there is none.
    pub(crate) fn cheaper(&self) -> Result<Box<dyn Simulation>, GapError> {
        let plant = self.plant.cheaper().unwrap_or(self.plant);
        Ok(plant.simulation(&self.nuisances, &self.entries)?)
    }

    pub(crate) fn warm_up(&self, options: &RolloutOptions) -> WarmUp {
        WarmUp::required(self.model(), &self.entries, options)
    }
}
