//! The drag law.

use hydro_frames::{Twist, Wrench};
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Density at which the matrices are stated [kg/m^3].
pub(super) const REFERENCE_DENSITY: f64 = 1000.0;

/// Fitted drag matrices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drag {
    /// `D_L` [N s/m, N s, N m s/m, N m s], rows (force, torque), columns (v, omega).
    pub linear: SMatrix<f64, 6, 6>,
    /// `D_Q`, the same with squared velocities.
    pub quadratic: SMatrix<f64, 6, 6>,
}

impl Drag {
    /// The drag wrench on the base, base frame.
    pub fn wrench(&self, twist: &Twist, density: f64) -> Wrench {
        let nu = stacked(twist);
        let drag = self.linear * nu + self.quadratic * nu.component_mul(&nu.abs());
        Wrench::from_array((-drag * (density / REFERENCE_DENSITY)).into())
    }
}

/// Velocities as one column, linear first as in marine craft notation.
pub(super) fn stacked(twist: &Twist) -> SVector<f64, 6> {
    let ([vx, vy, vz], [wx, wy, wz]) = (twist.linear, twist.angular);
    SVector::from([vx, vy, vz, wx, wy, wz])
}
