//! One instance of `hydro.wrench`: a checkpoint's wrench, named effects, or both.
//!
//! Its state holds the checkpoint's memory first (see [`super::learned_wrench`]), then that of the effects.

use super::{
    attributes::Settings,
    bound::{Afloat, BodyHull, Bound},
    learned_wrench::LearnedWrench,
    sea::Sea,
};

/// One instance, with its settings checked and its parts tied to a model.
#[derive(Debug)]
pub struct Instance {
    settings: Settings,
    learned: Option<LearnedWrench>,
    effects: Option<Bound>,
    afloat: Afloat,
}

impl Instance {
    /// An instance of its parts.
    pub fn new(
        settings: Settings,
        learned: Option<LearnedWrench>,
        effects: Option<Bound>,
        afloat: Afloat,
    ) -> Self {
        Self {
            settings,
            learned,
            effects,
            afloat,
        }
    }

    /// The checked attributes.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The checkpoint, tied to the model, where there is one.
    pub fn learned(&self) -> Option<&LearnedWrench> {
        self.learned.as_ref()
    }

    /// The effects, tied to the model, where there are any.
    pub fn effects(&self) -> Option<&Bound> {
        self.effects.as_ref()
    }

    /// Surface and waves.
    pub fn sea(&self) -> &Sea {
        &self.afloat.sea
    }

    /// Hulls whose submerged part fades the checkpoint's wrench.
    pub fn hulls(&self) -> &[BodyHull] {
        &self.afloat.hulls
    }

    /// Index in the state where the memory of the effects starts.
    pub fn learned_len(&self) -> usize {
        self.learned.as_ref().map_or(0, LearnedWrench::state_len)
    }
}
