//! The decision: named, confusable, unknown, or no gap.

use hydro_effects::Id;

use crate::{
    fit::{
        hypothesis::Fit,
        linearized_problem::{Adequacy, LinearizedProblem},
    },
    output::verdict::Outcome,
    select::{
        evidence::{Scored, mechanisms},
        search::Search,
    },
    stage::posterior::Weights,
};

pub(crate) struct Decision {
    pub(crate) outcome: Outcome,
    pub(crate) chosen: usize,
    pub(crate) named: Vec<(Id, String)>,
    pub(crate) confusion: Vec<Id>,
    /// Two refitted sets that an experiment should tell apart.
    pub(crate) apart: Option<(usize, usize)>,
    pub(crate) unexplained: f64,
    pub(crate) p_value: f64,
}

pub(crate) fn decide(
    linearized: &LinearizedProblem<'_>,
    search: &Search,
    weights: &Weights,
    adequacy: Adequacy,
) -> Decision {
    let empty = &search.scored[0];
    let best = weights.best();
    let least = &search.scored[best];
    let mut decision = Decision {
        outcome: Outcome::NoGap,
        chosen: 0,
        named: Vec::new(),
        confusion: Vec::new(),
        apart: None,
        unexplained: unexplained_part(linearized, &empty.fit, &least.fit),
        p_value: adequacy.p_value,
    };
    if adequacy.p_value <= linearized.problem.options.name.inadequate_p_value {
        decision.outcome = Outcome::Unknown;
        decision.chosen = best;
        return decision;
    }
    // The set of highest probability, cut back until its mean error is small.
    let ids = weights.ids(linearized, search);
    let set_ids: Vec<Id> = {
        let mut set: Vec<Id> = least
            .set
            .iter()
            .map(|candidate| linearized.problem.candidates[*candidate].effect)
            .collect();
        set.sort_by(|a, b| ids[b].total_cmp(&ids[a]));
        set.dedup();
        set
    };
    let mut kept = 0;
    let mut error = 0.0;
    for id in &set_ids {
        error += 1.0 - ids[id];
        if error / (kept + 1) as f64 > linearized.problem.options.name.error {
            break;
        }
        kept += 1;
    }
    let rivals = rivals(linearized, search, weights, best);
    let undecided: Vec<Id> = rivals
        .iter()
        .flat_map(|rival| {
            search.scored[*rival]
                .set
                .iter()
                .map(|candidate| linearized.problem.candidates[*candidate].effect)
        })
        .filter(|id| !set_ids.contains(id))
        .collect();
    // What stands in every rival too is decided all the same.
    let decided: Vec<Id> = set_ids[..kept]
        .iter()
        .filter(|id| {
            rivals.iter().all(|rival| {
                search.scored[*rival]
                    .set
                    .iter()
                    .any(|candidate| linearized.problem.candidates[*candidate].effect == **id)
            })
        })
        .copied()
        .collect();
    let something = 1.0 - weights.scored[0];
    if least.set.is_empty()
        || (kept == 0 && something < 1.0 - linearized.problem.options.name.error)
    {
        return decision;
    }
    if !undecided.is_empty() || decided.is_empty() {
        let mut confusion: Vec<Id> = set_ids
            .iter()
            .filter(|id| !decided.contains(id))
            .copied()
            .chain(undecided)
            .collect();
        confusion.sort_unstable();
        confusion.dedup();
        if confusion.len() < 2 {
            // No rival is near by output: the posterior alone is split.
            confusion = ids
                .iter()
                .filter(|(_, p)| **p > linearized.problem.options.name.error)
                .map(|(id, _)| *id)
                .collect();
        }
        confusion.sort_by(|a, b| {
            let p = |id: &Id| ids.get(id).copied().unwrap_or(0.0);
            p(b).total_cmp(&p(a))
        });
        decision.confusion = confusion;
        // Where no rival is near by output, the likeliest of the others that hold a member which the best lacks.
        let holds_another = |at: &usize| {
            let mut set = search.scored[*at].set.iter();
            set.any(|candidate| {
                let id = linearized.problem.candidates[*candidate].effect;
                decision.confusion.contains(&id) && !set_ids.contains(&id)
            })
        };
        let nearest = weights
            .likeliest(rivals.iter().copied())
            .or_else(|| weights.likeliest((0..search.scored.len()).filter(holds_another)));
        decision.apart = nearest.map(|rival| (best, rival));
    }
    decision.chosen = best;
    if decided.is_empty() {
        decision.outcome = Outcome::Confusable;
        if decision.confusion.len() < 2 {
            decision.confusion.clear();
            decision.apart = None;
            decision.outcome = Outcome::NoGap;
            decision.chosen = 0;
        }
        return decision;
    }
    decision.outcome = Outcome::Named;
    decision.named = least
        .set
        .iter()
        .filter(|candidate| decided.contains(&linearized.problem.candidates[**candidate].effect))
        .flat_map(|candidate| {
            let of = &linearized.problem.candidates[*candidate];
            of.targets
                .iter()
                .map(move |target| (of.effect, target.clone()))
        })
        .collect();
    // Only a set that was refitted can be added: find the likeliest that holds exactly what is decided.
    if decided.len() < set_ids.len() {
        let mut wanted = mechanisms(linearized, &least.set);
        wanted.retain(|(effect, _)| decided.contains(effect));
        let exact = (0..search.scored.len())
            .filter(|at| mechanisms(linearized, &search.scored[*at].set) == wanted);
        decision.chosen = weights.likeliest(exact).unwrap_or(best);
    }
    decision
}

/// Refitted sets of no more effects than the best whose outputs are as near to the data.
fn rivals(
    linearized: &LinearizedProblem<'_>,
    search: &Search,
    weights: &Weights,
    best: usize,
) -> Vec<usize> {
    let of = &search.scored[best];
    let ids = |scored: &Scored| -> Vec<Id> {
        let mut ids: Vec<Id> = scored
            .set
            .iter()
            .map(|candidate| linearized.problem.candidates[*candidate].effect)
            .collect();
        ids.sort_unstable();
        ids
    };
    // Uncertain numbers of the nominal may be bent to mimic an effect, at the price of their priors.
    let charge = |at: usize| {
        let scored = &search.scored[at];
        scored.fit.misfit / search.inflation + scored.fit.penalty
    };
    let probable =
        |at: usize| weights.whole[at] > linearized.problem.options.name.error * weights.whole[best];
    // The likeliest of its forms speaks for an explanation.
    let speaks = |at: usize| {
        let of = mechanisms(linearized, &search.scored[at].set);
        (0..search.scored.len()).all(|other| {
            weights.scored[other] <= weights.scored[at]
                || mechanisms(linearized, &search.scored[other].set) != of
        })
    };
    (1..search.scored.len())
        .filter(|at| {
            let other = &search.scored[*at];
            *at != best
                && other.set.len() <= of.set.len()
                && ids(other) != ids(of)
                && charge(*at) - charge(best) < linearized.problem.options.name.confusable
                && probable(*at)
                && speaks(*at)
        })
        .collect()
}

/// Part of the excess that a fit leaves.
pub(crate) fn unexplained_part(linearized: &LinearizedProblem<'_>, empty: &Fit, best: &Fit) -> f64 {
    let fitted = (2 * linearized.problem.model.nv * linearized.problem.segments.len()) as f64;
    let noise = (best.readings as f64 - fitted).max(1.0);
    let excess = (empty.misfit - noise).max(f64::MIN_POSITIVE);
    ((best.misfit - noise) / excess).clamp(0.0, 1.0)
}
