//! A set of effects at one level of unmodelled forces, with its likelihood and posterior.

use crate::likelihood::truncated_evidence::Truncated;

/// A member of a set: candidate, choice, scale.
pub(crate) type Member = (usize, usize, usize);

/// A set at one level.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) set: Vec<usize>,
    pub(crate) level: usize,
    /// The likeliest choices and scales.
    pub(crate) members: Vec<Member>,
    /// Columns of the members, and their posterior.
    pub(crate) columns: Vec<usize>,
    /// Precision of their priors.
    pub(crate) precision: Vec<f64>,
    /// What the mean over all choices and scales of a member adds to the log likelihood at the likeliest, by member.
    pub(crate) mixtures: Vec<f64>,
    pub(crate) posterior: Option<Truncated>,
    /// Log marginal likelihood, up to a constant.
    pub(crate) log_likelihood: f64,
    /// Log posterior, up to a constant.
    pub(crate) log_posterior: f64,
}

impl Found {
    /// True for the same set at the same level.
    pub(crate) fn is(&self, other: &Self) -> bool {
        self.level == other.level && self.set == other.set
    }
}
