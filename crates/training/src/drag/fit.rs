//! Least squares for the drag matrices.

use hydro_frames::{Twist, Wrench};
use nalgebra::{SMatrix, SVector, SymmetricEigen};
use thiserror::Error;

use super::law::{Drag, REFERENCE_DENSITY, stacked};

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
        /// Number of samples.
        samples: usize,
        /// Condition number of the normal equations, columns scaled.
        condition: f64,
    },
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
    /// Samples that leave a coefficient undetermined.
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
#[path = "tests/fit.rs"]
mod tests;
