//! The decision: named, confusable, unknown, or no gap.

use std::collections::BTreeMap;

use hydro_effects::Id;

use crate::{
    likelihood::explanation::Explanation,
    output::verdict::{Calibration, Outcome},
};

pub(crate) struct Decision {
    pub(crate) outcome: Outcome,
    /// Row of the chosen set; of the empty one where nothing is chosen.
    pub(crate) chosen: usize,
    /// Named candidates, with the part of the excess that each explains.
    pub(crate) named: BTreeMap<usize, f64>,
    /// Part of the excess that the chosen set explains.
    pub(crate) explained: Option<f64>,
    pub(crate) confusion: Vec<Id>,
    /// Two sets that an experiment should tell apart.
    pub(crate) apart: Option<(usize, usize)>,
}

/// Decides by probabilities: of any gap, of every effect given that there is one, and by what the set explains.
pub(crate) fn decide(explanation: &Explanation<'_>, calibration: &Calibration) -> Decision {
    let options = &explanation.problem.settings.options.name;
    let nothing = explanation.nothing();
    let (agreement, unmodelled) = explanation.without_effects();
    let mut decision = Decision {
        outcome: Outcome::NoGap,
        chosen: nothing,
        named: BTreeMap::new(),
        explained: None,
        confusion: Vec::new(),
        apart: None,
    };
    if agreement > options.agreement || calibration.alarm > calibration.alarm_level {
        return decision;
    }
    decision.outcome = Outcome::Unknown;
    let gap = 1.0 - agreement;
    let best = (0..explanation.sets.len()).find(|row| *row != nothing);
    let Some(best) = best.filter(|_| unmodelled < options.unmodelled * gap) else {
        return decision;
    };
    decision.chosen = best;
    let explained = |without: &[usize]| explanation.explained(best, without);
    let whole = explained(&[]);
    decision.explained = Some(whole);
    if whole < options.explained {
        return decision;
    }
    let mut probabilities = explanation.ids();
    for p in probabilities.values_mut() {
        *p /= gap;
    }
    let set = &explanation.sets[best].set;
    let id = |candidate: &usize| explanation.problem.candidates[*candidate].effect;
    let sure: Vec<usize> = set
        .iter()
        .copied()
        .filter(|of| {
            probabilities
                .get(&id(of))
                .is_some_and(|p| *p >= options.named)
        })
        .collect();
    if sure.len() < set.len() {
        let decided: Vec<Id> = sure.iter().map(id).collect();
        decision.confusion = confusion(&probabilities, &decided, options.error);
        let own = explanation.effects(set);
        let rival = (0..explanation.sets.len())
            .find(|row| *row != nothing && explanation.effects(&explanation.sets[*row].set) != own);
        decision.apart = rival.map(|rival| (best, rival));
    }
    decision.named = sure
        .iter()
        .map(|candidate| (*candidate, whole - explained(&[*candidate])))
        .collect();
    if decision.named.is_empty() {
        decision.outcome = match decision.confusion.len() {
            0 | 1 => Outcome::Unknown,
            _ => Outcome::Confusable,
        };
        return decision;
    }
    decision.outcome = Outcome::Named;
    let kept: Vec<usize> = decision.named.keys().copied().collect();
    let exact = explanation.sets.iter().position(|of| of.set == kept);
    decision.chosen = exact.unwrap_or(best);
    let others: Vec<usize> = set
        .iter()
        .copied()
        .filter(|of| !kept.contains(of))
        .collect();
    decision.explained = Some(explained(&others));
    decision
}

/// Effects that are neither decided nor improbable, the likeliest first.
fn confusion(probabilities: &BTreeMap<Id, f64>, decided: &[Id], error: f64) -> Vec<Id> {
    let mut open: Vec<(Id, f64)> = probabilities
        .iter()
        .filter(|(id, p)| **p > error && !decided.contains(id))
        .map(|(id, p)| (*id, *p))
        .collect();
    open.sort_by(|a, b| b.1.total_cmp(&a.1));
    open.into_iter().map(|(id, _)| id).collect()
}
