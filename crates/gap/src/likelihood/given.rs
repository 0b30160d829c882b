//! The likelihood of a set's columns, what stands beside the set integrated out.

use nalgebra::{DMatrix, DVector};

use crate::likelihood::{
    found::Held,
    quadratic::{Marginal, Quadratic},
};

/// The likelihood of parameters, uncertain numbers and some errors of form integrated out.
pub(crate) struct Given {
    /// Likelihood of the point's own parameters and directions.
    pub(crate) quadratic: Quadratic,
    /// Log likelihood where they are zero.
    pub(crate) empty: f64,
    /// Places, among all parameters, of those that were integrated out.
    pub(super) beside: Vec<usize>,
    /// Its best values where the rest is zero, and how far they move, turned round, with it.
    at_zero: DVector<f64>,
    response: DMatrix<f64>,
}

impl Given {
    /// From the likelihood of what stands beside a set, some of it held, then of the rest, and half its log determinant.
    pub(super) fn beside(
        joint: &Quadratic,
        half: f64,
        (beside, held): (&[usize], &Held),
    ) -> Option<Self> {
        let rest = joint.b.len() - beside.len();
        let known = beside.iter().map(|of| held.get(of).copied());
        let known: Vec<Option<f64>> = known.chain(std::iter::repeat_n(None, rest)).collect();
        let free = beside.iter().copied().filter(|of| !held.contains_key(of));
        let free: Vec<usize> = free.collect();
        let of = joint.with_known(&known).marginal(free.len())?;
        Some(Self::new(free, of, half))
    }

    pub(super) fn new(beside: Vec<usize>, of: Marginal, half: f64) -> Self {
        Self {
            empty: -0.5 * of.rest.q - half - of.half_log_determinant,
            quadratic: of.rest,
            beside,
            at_zero: of.at_zero,
            response: of.response,
        }
    }

    pub(super) fn select(&self, columns: &[usize]) -> Self {
        Self {
            quadratic: self.quadratic.select(columns),
            empty: self.empty,
            beside: self.beside.clone(),
            at_zero: self.at_zero.clone(),
            response: self.response.select_columns(columns),
        }
    }

    /// The best values of what was integrated out beside some of the rest.
    pub(super) fn beside_values(&self, rest: &DVector<f64>) -> DVector<f64> {
        &self.at_zero - &self.response * rest
    }
}
