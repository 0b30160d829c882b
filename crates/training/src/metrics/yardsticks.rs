//! Predictions that nothing was learnt for. A model that loses to one of them is not trained.

use crate::dataset::Split;

/// A prediction without learning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Yardstick {
    /// The buoyancy, which is known exactly, and nothing else.
    Buoyancy,
    /// The true first force of a trajectory, held.
    FirstForce,
}

impl Yardstick {
    /// Those that a split allows: without a recorded buoyancy there is none to predict.
    pub fn of_split(split: &Split) -> Vec<Self> {
        let known =
            (0..split.len()).any(|index| split.hydrostatic(index).iter().any(|v| *v != 0.0));
        let buoyancy = known.then_some(Self::Buoyancy);
        buoyancy.into_iter().chain([Self::FirstForce]).collect()
    }

    /// Name in a table.
    pub fn label(self) -> &'static str {
        match self {
            Self::Buoyancy => "exact buoyancy alone (no learning)",
            Self::FirstForce => "the first force, held (no learning)",
        }
    }

    /// The force along a trajectory of a split, [T f].
    pub fn predict(self, split: &Split, trajectory: usize) -> Vec<f64> {
        match self {
            Self::Buoyancy => {
                let values = split.hydrostatic(trajectory).iter();
                values.map(|value| f64::from(*value)).collect()
            }
            Self::FirstForce => {
                let first = &split.clean(trajectory)[..split.outputs()];
                let held = first.iter().cycle().take(split.samples() * first.len());
                held.map(|value| f64::from(*value)).collect()
            }
        }
    }
}

#[cfg(test)]
#[path = "tests/yardsticks.rs"]
mod tests;
