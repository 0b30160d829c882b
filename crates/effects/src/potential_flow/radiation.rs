//! Memory of the waves that a body has made.

use nalgebra::{DMatrix, DVector, Vector6};

/// Most numbers of memory.
pub(super) const MOST_STATES: usize = 256;

/// x' = a x + b nu, F = -c x.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Radiation {
    pub(super) a: DMatrix<f64>,
    pub(super) b: DMatrix<f64>,
    pub(super) c: DMatrix<f64>,
}

/// The memory over a step of a certain length, by the trapezoidal rule: of second order and stable whatever the step; the
/// velocity is taken as constant.
#[derive(Clone, Debug)]
pub struct Stepping {
    /// Length [s].
    pub step: f64,
    keep: DMatrix<f64>,
    add: DMatrix<f64>,
}

impl Radiation {
    pub(super) fn len(&self) -> usize {
        self.a.nrows()
    }

    pub(super) fn force(&self, memory: &[f64]) -> Vector6<f64> {
        if self.len() == 0 || memory.len() != self.len() {
            return Vector6::zeros();
        }
        let force = -(&self.c * DVector::from_column_slice(memory));
        Vector6::from_column_slice(force.as_slice())
    }

    /// `None` for a step that is none, and without memory.
    pub(super) fn stepping(&self, step: f64) -> Option<Stepping> {
        if self.len() == 0 || step.is_nan() || step <= 0.0 {
            return None;
        }
        let half = &self.a * (0.5 * step);
        let unit = DMatrix::identity(self.len(), self.len());
        let solver = (&unit - &half).lu();
        Some(Stepping {
            step,
            keep: solver.solve(&(unit + half))?,
            add: solver.solve(&(&self.b * step))?,
        })
    }
}

impl Stepping {
    /// Advances the memory over the step at this velocity [m/s, rad/s].
    pub fn advance(&self, velocity: &Vector6<f64>, memory: &mut [f64]) {
        if memory.len() != self.keep.nrows() {
            return;
        }
        let next = &self.keep * DVector::from_column_slice(memory) + &self.add * velocity;
        if next.iter().all(|value| value.is_finite()) {
            memory.copy_from_slice(next.as_slice());
        }
    }
}
