//! Projection of whitened residuals off the start of a segment, a nuisance with a normal prior.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Projection off the start of one segment.
#[derive(Clone, Debug)]
pub(crate) struct StartProjection {
    /// Sensitivity to the start [readings, 2 nv].
    pub(crate) sensitivity: DMatrix<f32>,
    factor: Cholesky<f64, Dyn>,
}

impl StartProjection {
    /// `None` where the matrix is not finite.
    pub(crate) fn new(sensitivity: &DMatrix<f64>, precision: &DVector<f64>) -> Option<Self> {
        let mut normal = sensitivity.tr_mul(sensitivity);
        for axis in 0..precision.len() {
            normal[(axis, axis)] += precision[axis];
        }
        Some(Self {
            factor: normal.cholesky()?,
            sensitivity: sensitivity.map(|value| value as f32),
        })
    }

    /// `H^T columns`.
    fn onto(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        // Not `tr_mul`: a product of whole matrices is blocked, many times faster.
        self.sensitivity.map(f64::from).transpose() * columns
    }

    /// `columns^T W columns`.
    pub(crate) fn gram(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let onto = self.onto(columns);
        let solved = self.factor.solve(&onto);
        columns.transpose() * columns - onto.transpose() * solved
    }

    /// The start that fits a residual best, as a tangent; the residual was taken at the start `now`. The prior of a
    /// start is about where the linearised problem has it (settled under the nominal), not about where it is now.
    pub(crate) fn start(&self, mut residual: DMatrix<f64>, now: &DVector<f64>) -> DVector<f64> {
        residual += self.sensitivity.map(f64::from) * now;
        let onto = self.onto(&residual);
        self.factor.solve(&onto).column(0).into_owned()
    }

    /// The columns after the start is fitted to each.
    pub(crate) fn project(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let solved = self.factor.solve(&self.onto(columns));
        columns - self.sensitivity.map(f64::from) * solved
    }
}
