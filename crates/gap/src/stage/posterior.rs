//! Posterior probabilities of the refitted sets.

use std::collections::BTreeMap;

use hydro_effects::Id;

use crate::{
    fit::linearized_problem::LinearizedProblem,
    select::{
        evidence::{log_prior, mechanisms},
        search::Search,
    },
};

/// Posterior probabilities.
pub(crate) struct Weights {
    /// Probability of every refitted set.
    pub(crate) scored: Vec<f64>,
    /// The same summed over all forms of its effects.
    pub(crate) whole: Vec<f64>,
    /// Log evidence of every refitted set, absolute.
    pub(crate) evidence: Vec<f64>,
}

impl Weights {
    pub(crate) fn new(linearized: &LinearizedProblem<'_>, search: &Search) -> Self {
        let evidence: Vec<f64> = search
            .scored
            .iter()
            .map(|scored| {
                scored
                    .fit
                    .evidence(search.inflation)
                    .map_or(f64::NEG_INFINITY, |(evidence, _)| evidence)
            })
            .collect();
        let logs: Vec<f64> = search
            .scored
            .iter()
            .zip(&evidence)
            .map(|(scored, evidence)| evidence + log_prior(linearized, &scored.set))
            .collect();
        let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut scored: Vec<f64> = logs.iter().map(|log| (log - top).exp()).collect();
        let sum: f64 = scored.iter().sum();
        scored.iter_mut().for_each(|weight| *weight /= sum);
        let mechanisms: Vec<_> = (search.scored.iter())
            .map(|scored| mechanisms(linearized, &scored.set))
            .collect();
        let whole = (mechanisms.iter())
            .map(|of| {
                let forms = mechanisms.iter().zip(&scored);
                forms
                    .filter(|(other, _)| *other == of)
                    .map(|(_, p)| p)
                    .sum()
            })
            .collect();
        Self {
            scored,
            whole,
            evidence,
        }
    }

    /// The likeliest form of the likeliest of some sets.
    pub(crate) fn likeliest(&self, among: impl Iterator<Item = usize>) -> Option<usize> {
        let (whole, scored) = (&self.whole, &self.scored);
        among.max_by(|a, b| {
            (whole[*a].total_cmp(&whole[*b])).then(scored[*a].total_cmp(&scored[*b]))
        })
    }

    /// The likeliest of all sets.
    pub(crate) fn best(&self) -> usize {
        self.likeliest(0..self.scored.len()).unwrap_or(0)
    }

    /// Probability that a candidate is in the true set.
    pub(crate) fn candidates(&self, search: &Search) -> BTreeMap<usize, f64> {
        let mut sums = BTreeMap::new();
        for (scored, weight) in search.scored.iter().zip(&self.scored) {
            for candidate in &scored.set {
                *sums.entry(*candidate).or_insert(0.0) += weight;
            }
        }
        sums
    }

    /// Probability that an effect is missing, on whatever target.
    pub(crate) fn ids(
        &self,
        linearized: &LinearizedProblem<'_>,
        search: &Search,
    ) -> BTreeMap<Id, f64> {
        let mut sums = BTreeMap::new();
        for (scored, weight) in search.scored.iter().zip(&self.scored) {
            let mut ids: Vec<Id> = scored
                .set
                .iter()
                .map(|candidate| linearized.problem.candidates[*candidate].effect)
                .collect();
            ids.sort_unstable();
            ids.dedup();
            for id in ids {
                *sums.entry(id).or_insert(0.0) += weight;
            }
        }
        sums
    }
}
