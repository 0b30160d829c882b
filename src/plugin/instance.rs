//! One instance of `hydro.wrench`: a checkpoint's wrench, named effects, or both.
//!
//! Its state holds the checkpoint's memory first (see [`super::learned_wrench`]), then that of the effects.

use super::{attributes::Settings, bound::Bound, learned_wrench::LearnedWrench};

/// One instance, with its settings checked and its parts tied to a model.
#[derive(Debug)]
pub struct Instance {
    settings: Settings,
    learned: Option<LearnedWrench>,
    effects: Option<Bound>,
}

impl Instance {
    /// An instance of its parts.
    pub fn new(settings: Settings, learned: Option<LearnedWrench>, effects: Option<Bound>) -> Self {
        Self {
            settings,
            learned,
            effects,
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

    /// Index in the state where the memory of the effects starts.
    pub fn learned_len(&self) -> usize {
        self.learned.as_ref().map_or(0, LearnedWrench::state_len)
    }
}
