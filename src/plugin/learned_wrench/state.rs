//! The memory of a learned wrench: a slice of plugin state, which MuJoCo copies, saves and restores.
//!
//! For n features, f outputs and an engine with M numbers of memory it holds
//!
//! | offset | numbers | meaning |
//! |---|---|---|
//! | 0 | 1 | phase: 0 cold, 1 warm, 2 faulted |
//! | 1 | 1 | samples taken since the start |
//! | 2 | 1 | time of the latest sample [s] |
//! | 3 | 1 | end of the latest step [s] |
//! | 4 | 1 | 1 once a velocity was out of the network's range, else 0 |
//! | 5 | f | force at the latest sample [N, N m] |
//! | 5 + f | f | force one sample period later |
//! | 5 + 2f | f | drag at the latest sample of the velocities out of the network's range |
//! | 5 + 3f | n | features at the end of the latest step |
//! | 5 + 3f + n | M | the engine's memory of earlier samples |
//!
//! For a model that does not predict the next force, both forces are the one at the sample.

use hydro_model::Engine;

use super::cold_start::Place;

pub(super) const SAMPLES: usize = 1;
pub(super) const SAMPLE_TIME: usize = 2;
pub(super) const STEP_TIME: usize = 3;
pub(super) const OUT_OF_RANGE: usize = 4;
pub(super) const FORCES: usize = 5;
const PHASE: usize = 0;

/// The first number of the state.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    Cold = 0,
    Warm = 1,
    Faulted = 2,
}

impl Phase {
    pub(super) fn read(state: &[f64]) -> Self {
        match state[PHASE] as u8 {
            0 => Self::Cold,
            1 => Self::Warm,
            _ => Self::Faulted,
        }
    }

    pub(super) fn write(self, state: &mut [f64]) {
        state[PHASE] = f64::from(self as u8);
    }
}

/// Numbers of state that an engine's instance needs.
pub fn state_len(engine: &dyn Engine) -> usize {
    FORCES + 3 * engine.outputs() + engine.inputs() + engine.memory_len()
}

/// Address of the state.
pub(super) fn place(state: &[f64]) -> Place {
    state.as_ptr() as Place
}
