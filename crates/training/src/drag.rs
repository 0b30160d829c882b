//! Linear plus quadratic drag on the base twist, fitted by least squares: the model that a user would
//! write by hand, and a rival of the learned one.
//!
//! `w = -rho / rho_0 (D_L nu + D_Q |nu| nu)` with full 6 x 6 matrices, `nu = (v, omega)` in the base frame
//! and `|nu| nu` taken component by component (Fossen, *Handbook of Marine Craft Hydrodynamics and
//! Motion Control*, 2011, section 6.4). Buoyancy is not part of it: it is exact in every rival.

use nalgebra::{SMatrix, SVector, SymmetricEigen};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use hydro_frames::{Twist, Wrench};

/// Density at which the matrices are stated [kg/m^3].
const REFERENCE_DENSITY: f64 = 1000.0;
/// Columns of the regression: six linear and six quadratic.
const COLUMNS: usize = 12;

/// Why a fit was refused.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DragError {
    /// The motions do not excite every coefficient.
    #[error(
        "the {samples} samples do not determine the drag: the regression's condition number is {condition:.1e}, \
         at most 1e12 is usable; every velocity component must vary"
    )]
    Unexcited {
        /// How many samples.
        samples: usize,
        /// Condition number of the normal equations, columns scaled.
        condition: f64,
    },
}

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
fn stacked(twist: &Twist) -> SVector<f64, 6> {
    let ([vx, vy, vz], [wx, wy, wz]) = (twist.linear, twist.angular);
    SVector::from([vx, vy, vz, wx, wy, wz])
}

/// Normal equations of the fit; samples are added as they are read, none is kept.
#[derive(Clone, Debug)]
pub struct DragFit {
    gram: SMatrix<f64, COLUMNS, COLUMNS>,
    moment: SMatrix<f64, COLUMNS, 6>,
    samples: usize,
}

impl Default for DragFit {
    fn default() -> Self {
        Self {
            gram: SMatrix::zeros(),
            moment: SMatrix::zeros(),
            samples: 0,
        }
    }
}

impl DragFit {
    /// Adds a sample: the twist, the density [kg/m^3] and the measured wrench without buoyancy.
    pub fn add(&mut self, twist: &Twist, density: f64, wrench: &Wrench) {
        let nu = stacked(twist);
        let scale = -density / REFERENCE_DENSITY;
        let mut column = SVector::<f64, COLUMNS>::zeros();
        column.fixed_rows_mut::<6>(0).copy_from(&(nu * scale));
        column
            .fixed_rows_mut::<6>(6)
            .copy_from(&(nu.component_mul(&nu.abs()) * scale));
        let target = SVector::<f64, 6>::from(wrench.to_array());
        self.gram += column * column.transpose();
        self.moment += column * target.transpose();
        self.samples += 1;
    }

    /// The best drag of each axis on its own: diagonal matrices without negative entries, so that it
    /// never drives a motion.
    pub fn solve_diagonal(&self) -> Drag {
        let mut drag = Drag {
            linear: SMatrix::zeros(),
            quadratic: SMatrix::zeros(),
        };
        for axis in 0..6 {
            let (l, q) = (axis, axis + 6);
            let gram = SMatrix::<f64, 2, 2>::new(
                self.gram[(l, l)],
                self.gram[(l, q)],
                self.gram[(q, l)],
                self.gram[(q, q)],
            );
            let moment = SVector::<f64, 2>::new(self.moment[(l, axis)], self.moment[(q, axis)]);
            let alone = |k: usize| (moment[k] / gram[(k, k)]).max(0.0);
            let both = gram.try_inverse().map(|inverse| inverse * moment);
            // Least squares under non-negativity: an inactive term is left out and the other fitted alone.
            let (linear, quadratic) = match both {
                Some(both) if both[0] >= 0.0 && both[1] >= 0.0 => (both[0], both[1]),
                Some(both) if both[0] < 0.0 => (0.0, alone(1)),
                Some(_) => (alone(0), 0.0),
                None => (0.0, 0.0),
            };
            drag.linear[(axis, axis)] = linear;
            drag.quadratic[(axis, axis)] = quadratic;
        }
        drag
    }

    /// Solves the normal equations, columns scaled to unit length first.
    ///
    /// # Errors
    /// Where the samples leave a coefficient undetermined.
    pub fn solve(&self) -> Result<Drag, DragError> {
        let length = self.gram.diagonal().map(f64::sqrt);
        let inverse_length = length.map(|l| if l > 0.0 { 1.0 / l } else { 0.0 });
        let scaling = SMatrix::<f64, COLUMNS, COLUMNS>::from_diagonal(&inverse_length);
        let scaled = scaling * self.gram * scaling;
        let SymmetricEigen {
            eigenvalues: values,
            eigenvectors: vectors,
        } = SymmetricEigen::new(scaled);
        let condition = values.max() / values.min().max(0.0);
        if condition.is_nan() || condition > 1e12 {
            return Err(DragError::Unexcited {
                samples: self.samples,
                condition,
            });
        }
        let inverse = vectors
            * SMatrix::<f64, COLUMNS, COLUMNS>::from_diagonal(&values.map(|v| 1.0 / v))
            * vectors.transpose();
        let coefficients = (scaling * inverse * scaling * self.moment).transpose();
        Ok(Drag {
            linear: coefficients.fixed_columns::<6>(0).into_owned(),
            quadratic: coefficients.fixed_columns::<6>(6).into_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Velocities that no two columns of the regression share.
    fn twist(i: usize) -> Twist {
        let wave =
            |k: usize| ((i * (k + 2)) as f64 * 0.7 + k as f64).sin() * (1.0 + k as f64 * 0.3);
        Twist {
            linear: [wave(0), wave(1), wave(2)],
            angular: [wave(3), wave(4), wave(5)],
        }
    }

    #[test]
    fn known_matrices_are_recovered() {
        let linear = SMatrix::from_fn(|r, c| {
            if r == c {
                10.0
            } else {
                0.3 * (r as f64 - c as f64)
            }
        });
        let quadratic = SMatrix::from_fn(|r, c| if r == c { 40.0 } else { 0.1 * (r + c) as f64 });
        let truth = Drag { linear, quadratic };
        let mut fit = DragFit::default();
        for i in 0..200 {
            let density = 990.0 + (i % 40) as f64;
            fit.add(&twist(i), density, &truth.wrench(&twist(i), density));
        }
        let found = fit.solve().unwrap();
        assert!((found.linear - linear).abs().max() < 1e-6);
        assert!((found.quadratic - quadratic).abs().max() < 1e-6);
    }

    #[test]
    fn the_diagonal_fit_recovers_a_diagonal_and_never_drives_a_motion() {
        let linear = SMatrix::from_diagonal(&SVector::from([1.0, 2.0, 3.0, 0.4, 0.5, 0.6]));
        let truth = Drag {
            linear,
            quadratic: linear * 7.0,
        };
        let (mut fit, mut driving) = (DragFit::default(), DragFit::default());
        for i in 0..200 {
            let wrench = truth.wrench(&twist(i), 1000.0);
            fit.add(&twist(i), 1000.0, &wrench);
            driving.add(
                &twist(i),
                1000.0,
                &Wrench::from_array(wrench.to_array().map(|v| -v)),
            );
        }
        let found = fit.solve_diagonal();
        assert!((found.linear - linear).abs().max() < 1e-8);
        assert!((found.quadratic - linear * 7.0).abs().max() < 1e-8);
        let none = driving.solve_diagonal();
        assert_eq!((none.linear.max(), none.quadratic.max()), (0.0, 0.0));
    }

    #[test]
    fn drag_opposes_motion_and_grows_with_density() {
        let drag = Drag {
            linear: SMatrix::identity(),
            quadratic: SMatrix::identity() * 2.0,
        };
        let towed = Twist {
            linear: [-3.0, 0.0, 0.0],
            angular: [0.0; 3],
        };
        assert_eq!(
            drag.wrench(&towed, 1000.0).force,
            [3.0 + 2.0 * 9.0, 0.0, 0.0]
        );
        assert_eq!(drag.wrench(&towed, 500.0).force[0], 10.5);
    }

    #[test]
    fn motion_along_one_axis_is_refused() {
        let mut fit = DragFit::default();
        for i in 0..50 {
            let along_x = Twist {
                linear: [i as f64, 0.0, 0.0],
                angular: [0.0; 3],
            };
            fit.add(&along_x, 1000.0, &Wrench::default());
        }
        let message = fit.solve().unwrap_err().to_string();
        assert!(message.contains("50 samples"), "{message}");
    }
}
