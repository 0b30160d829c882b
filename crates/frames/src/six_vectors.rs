//! The six-vectors of rigid-body mechanics: wrench and twist.

use serde::{Deserialize, Serialize};

/// Force [N] and torque [N m] about the base origin, both expressed in the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force in the base frame [N].
    pub force: [f64; 3],
    /// Torque about the base origin, in the base frame [N m].
    pub torque: [f64; 3],
}

impl Wrench {
    /// From `[fx, fy, fz, tx, ty, tz]`, the order of every data file and network output.
    pub fn from_array(values: [f64; 6]) -> Self {
        let [fx, fy, fz, tx, ty, tz] = values;
        Self {
            force: [fx, fy, fz],
            torque: [tx, ty, tz],
        }
    }

    /// As `[fx, fy, fz, tx, ty, tz]`.
    pub fn to_array(self) -> [f64; 6] {
        let [fx, fy, fz] = self.force;
        let [tx, ty, tz] = self.torque;
        [fx, fy, fz, tx, ty, tz]
    }

    /// True where all six components are finite.
    pub fn is_finite(&self) -> bool {
        self.to_array().iter().all(|value| value.is_finite())
    }
}

/// Angular [rad/s] and linear [m/s] velocity of the base origin, both expressed in the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Angular velocity in the base frame [rad/s].
    pub angular: [f64; 3],
    /// Linear velocity of the base origin relative to the water, in the base frame [m/s].
    pub linear: [f64; 3],
}
