//! A set of effects at one level of disturbances, with its likelihood and posterior.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::likelihood::{by_trial::Own, quadratic::Quadratic, truncated_evidence::Truncated};

/// A member of a set: candidate, choice, scale, and where every trial has a value of its own, which of the sizes.
pub(crate) type Member = (usize, usize, usize, Option<usize>);

/// Values of uncertain numbers and errors of form at a bound of their prior, by place among all parameters.
pub(crate) type Held = BTreeMap<usize, f64>;

/// A set at one level.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) set: Vec<usize>,
    pub(crate) level: usize,
    /// The likeliest choices and scales, and whether each trial has a value of its own.
    pub(crate) members: Vec<Member>,
    /// Columns of the members, and their posterior.
    pub(crate) columns: Vec<usize>,
    /// Columns with a value of each trial's own.
    pub(crate) own: Own,
    /// Uncertain numbers and errors of form beside the set at a bound of their prior.
    pub(crate) held: Held,
    /// Difference, by member, between the log likelihood averaged over its choices and scales and that of the likeliest.
    pub(crate) mixtures: Vec<f64>,
    pub(crate) posterior: Truncated,
    /// Log marginal likelihood, up to a constant.
    pub(crate) log_likelihood: f64,
    /// Log posterior, up to a constant.
    pub(crate) log_posterior: f64,
}

/// The set of the highest posterior.
pub(crate) fn likeliest<'f>(found: impl IntoIterator<Item = &'f Found>) -> Option<&'f Found> {
    let found = found.into_iter();
    found.max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior))
}

impl Found {
    /// True for the same set at the same level.
    pub(crate) fn is(&self, other: &Self) -> bool {
        self.level == other.level && self.set == other.set
    }

    /// Members with their mixtures, some candidates left out.
    pub(super) fn kept(&self, out: &[usize]) -> Vec<(Member, f64)> {
        let members = self.members.iter().copied();
        members
            .zip(self.mixtures.iter().copied())
            .filter(|(of, _)| !out.contains(&of.0))
            .collect()
    }

    /// The quadratic in some columns with the set's parameters integrated out, its bounds as soft as they were found.
    pub(super) fn conditional(&self, all: &Quadratic, columns: &[usize]) -> Quadratic {
        let mut of = all.select(columns);
        let across = DMatrix::from_fn(self.columns.len(), columns.len(), |row, column| {
            all.a[(self.columns[row], columns[column])]
        });
        of.a -= across.tr_mul(&(&self.posterior.covariance * &across));
        of.b -= across.tr_mul(&self.posterior.mean);
        of
    }
}
