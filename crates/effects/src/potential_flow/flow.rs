//! Potential flow about one hull, and the forces that follow.

use std::fmt;

use nalgebra::{Matrix6, Vector6};

use super::{
    excitation::Excitation,
    radiation::{Radiation, Stepping},
};
use crate::sea::{Component, WaveField};

/// Linear potential flow about one hull.
#[derive(Clone, PartialEq)]
pub struct PotentialFlow {
    /// Displaced volume at the draught [m^3].
    pub volume: f64,
    /// Point that forces and motions are about, body frame [m].
    pub point: [f64; 3],
    /// Added mass of infinite frequency.
    pub added_mass: Matrix6<f64>,
    pub(super) radiation: Radiation,
    pub(super) excitation: Option<Excitation>,
    /// Digest of the file: tells it from others.
    pub(super) digest: u64,
}

impl fmt::Debug for PotentialFlow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PotentialFlow")
            .field("states", &self.state_len())
            .field("digest", &self.digest)
            .finish_non_exhaustive()
    }
}

impl PotentialFlow {
    /// Numbers of memory.
    pub fn state_len(&self) -> usize {
        self.radiation.len()
    }

    /// True where waves push it.
    pub fn is_excited(&self) -> bool {
        self.excitation.is_some()
    }

    /// Force and moment of what the water remembers [N, N m].
    pub fn radiation_force(&self, memory: &[f64]) -> Vector6<f64> {
        self.radiation.force(memory)
    }

    /// How the memory goes over a step [s]; `None` for a step that is none, and without memory.
    pub fn stepping(&self, step: f64) -> Option<Stepping> {
        self.radiation.stepping(step)
    }

    /// Force and moment [N, N m] of waves on a body upright at a place x, y [m] and heading [rad], in axes of that heading.
    pub fn excitation_force(
        &self,
        waves: &WaveField,
        place: [f64; 2],
        heading: f64,
        time: f64,
    ) -> Vector6<f64> {
        let Some(excitation) = &self.excitation else {
            return Vector6::zeros();
        };
        let components = waves.components().iter();
        components.fold(Vector6::zeros(), |sum, wave: &Component| {
            sum + excitation.force(wave, place, heading, time)
        })
    }
}
