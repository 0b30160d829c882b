//! Sets of effects with their fits, priors and posterior probabilities.

use std::collections::BTreeSet;

use hydro_effects::Id;

use crate::{
    discrepancy::adequacy,
    error::GapError,
    fit::{
        hypothesis::Fit,
        linearized_problem::{Adequacy, LinearizedProblem},
    },
    progress::Watch,
};

/// A set with its nonlinear fit.
#[derive(Debug)]
pub(crate) struct Scored {
    /// Rows of the candidates, ascending.
    pub(crate) set: Vec<usize>,
    pub(crate) fit: Fit,
    /// Once it was asked for.
    adequacy: Option<Adequacy>,
}

impl Scored {
    pub(crate) fn new(set: Vec<usize>, fit: Fit) -> Self {
        Self {
            set,
            fit,
            adequacy: None,
        }
    }

    /// Evidence and prior, up to a constant [nat].
    pub(crate) fn log_posterior(
        &self,
        linearized: &LinearizedProblem<'_>,
        inflation: f64,
    ) -> Option<f64> {
        let (evidence, _) = self.fit.evidence(inflation)?;
        Some(evidence + log_prior(linearized, &self.set))
    }
}

/// Log prior of a set of candidates: by number of effects, then by effect, by target, and by form.
pub(crate) fn log_prior(linearized: &LinearizedProblem<'_>, set: &[usize]) -> f64 {
    let options = &linearized.problem.options.search;
    let mut log = options.prior_by_size[set.len().min(options.largest)].ln();
    for (at, candidate) in set.iter().enumerate() {
        log += ((at + 1) as f64).ln() + linearized.problem.log_shares[*candidate];
    }
    log
}

/// True where two candidates cannot be in one set.
pub(crate) fn clash(linearized: &LinearizedProblem<'_>, a: usize, b: usize) -> bool {
    linearized.problem.candidates[a].clashes(&linearized.problem.candidates[b])
}

/// Effects and targets of a set, whatever the forms of its candidates.
pub(crate) fn mechanisms<'b>(
    linearized: &'b LinearizedProblem<'_>,
    set: &[usize],
) -> Vec<(Id, &'b [String])> {
    let mut mechanisms: Vec<_> = set
        .iter()
        .map(|at| linearized.problem.candidates[*at].mechanism())
        .collect();
    mechanisms.sort_unstable();
    mechanisms
}

/// The first of all entries whose sets have the same effects and targets.
pub(crate) fn firsts<T>(
    linearized: &LinearizedProblem<'_>,
    all: impl Iterator<Item = T>,
    set: impl Fn(&T) -> &[usize],
) -> Vec<T> {
    let mut seen = BTreeSet::new();
    all.filter(|of| seen.insert(mechanisms(linearized, set(of))))
        .collect()
}

/// The refitted set with the highest posterior.
pub(crate) fn best_of(
    linearized: &LinearizedProblem<'_>,
    scored: &[Scored],
    inflation: f64,
) -> Option<usize> {
    (0..scored.len())
        .filter_map(|at| Some((at, scored[at].log_posterior(linearized, inflation)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(at, _)| at)
}

/// Whether a set leaves only noise; computed once.
pub(crate) fn adequate(
    linearized: &LinearizedProblem<'_>,
    scored: &mut Scored,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Adequacy, GapError> {
    if let Some(known) = scored.adequacy {
        return Ok(known);
    }
    let found = if scored.set.is_empty() {
        adequacy::assess_empty(linearized, seed, watch)?
    } else {
        adequacy::assess(linearized, &scored.fit, seed, watch)?
    };
    scored.adequacy = Some(found);
    Ok(found)
}
