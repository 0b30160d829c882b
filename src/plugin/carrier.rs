//! What one `hydro.wrench` puts on its body: a checkpoint's wrench, named effects, or both.
//!
//! The state of an instance holds the checkpoint's memory first (see `instance`), then that of the
//! effects.

use super::{attributes::Settings, bound::Bound, instance::Instance};

/// One plugin instance.
#[derive(Debug)]
pub struct Carrier {
    settings: Settings,
    learned: Option<Instance>,
    effects: Option<Bound>,
}

impl Carrier {
    /// From its parts.
    pub fn new(settings: Settings, learned: Option<Instance>, effects: Option<Bound>) -> Self {
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
    pub fn learned(&self) -> Option<&Instance> {
        self.learned.as_ref()
    }

    /// The effects, tied to the model, where there are any.
    pub fn effects(&self) -> Option<&Bound> {
        self.effects.as_ref()
    }

    /// Where the memory of the effects starts in the state.
    pub fn learned_len(&self) -> usize {
        self.learned.as_ref().map_or(0, Instance::state_len)
    }
}
