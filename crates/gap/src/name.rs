//! Name: which effect is missing, how surely, and what else it could be.

use std::collections::BTreeMap;

use hydro_effects::Id;

use super::{
    adequacy::Adequacy,
    bench::Bench,
    error::GapError,
    experiment,
    fit::Fit,
    fitted::{nuisances, parameters},
    search::{self, Scored, Search},
    stages::{Hypothesis, Named},
    study::Study,
    verdict::{FittedEffect, Outcome},
    watch::Watch,
};

/// Schema of [`Named`].
const SCHEMA: &str = "hydro-gap-name/1";

/// Mean probability of error above which nothing more is named; a rival less probable than this part of the best is
/// none, however near its outputs: it needs more luck in its values.
const ERROR: f64 = 0.05;
/// Two explanations whose whitened outputs are nearer than this (squared) are one set.
const CONFUSION: f64 = 9.0;
/// Effects less probable than this are not listed.
const NEGLIGIBLE: f64 = 1e-3;
/// Probability of as much structure left, were the best set right, at or below which it is not.
const INADEQUATE: f64 = 0.01;
/// Sets shown.
const SHOWN: usize = 20;
/// What the name stage found, with the fit that `add` writes down.
#[derive(Debug)]
pub struct Naming {
    /// For the file.
    pub named: Named,
    pub(super) search: Search,
    /// The refitted set that was chosen; the empty one where nothing is.
    pub(super) chosen: usize,
}

/// Searches, weighs and decides.
///
/// # Errors
/// Where the plant refuses, or a stop was asked for.
pub fn name(study: &Study<'_>, bench: &Bench<'_>, watch: &Watch<'_>) -> Result<Naming, GapError> {
    let mut search = search::search(bench, study.settings.seed, watch)?;
    let weights = Weights::of(bench, &search);
    let best = weights.best();
    let adequacy = search::adequate(bench, &mut search.scored[best], study.settings.seed, watch)?;
    let decision = decide(bench, &search, &weights, adequacy);
    let scored = &search.scored[decision.chosen];
    let effects = listed(bench, &search, &weights, &decision);
    let chosen = effects
        .iter()
        .filter(|effect| {
            decision
                .named
                .contains(&(effect.effect, effect.target.clone()))
        })
        .cloned()
        .collect();
    let nuisances = nuisances(bench, &scored.fit, search.factor);
    let apart = decision.apart.map(|(one, other)| {
        let [one, other] = [one, other].map(|of| &search.scored[of].fit.point);
        experiment::next(bench, one, other, &study.commands, watch)
    });
    let next_experiment = apart.transpose()?;
    let named = Named {
        schema: SCHEMA.to_owned(),
        outcome: decision.outcome,
        chosen,
        effects,
        confusion_set: decision.confusion,
        next_experiment,
        ranking: ranking(bench, &search, &weights),
        nuisances,
        unexplained: decision.unexplained,
        unexplained_p_value: decision.p_value,
        remarks: Vec::new(),
    };
    Ok(Naming {
        named,
        chosen: decision.chosen,
        search,
    })
}

/// Posterior probabilities.
struct Weights {
    /// Of every refitted set.
    scored: Vec<f64>,
    /// Of what it stands for: all forms of its effects together.
    whole: Vec<f64>,
    /// Log evidence of every refitted set, absolute.
    evidence: Vec<f64>,
}

impl Weights {
    fn of(bench: &Bench<'_>, search: &Search) -> Self {
        let evidence: Vec<f64> = search
            .scored
            .iter()
            .map(|scored| {
                scored
                    .fit
                    .evidence(search.factor)
                    .map_or(f64::NEG_INFINITY, |(evidence, _)| evidence)
            })
            .collect();
        let logs: Vec<f64> = search
            .scored
            .iter()
            .zip(&evidence)
            .map(|(scored, evidence)| evidence + search::log_prior(bench, &scored.set))
            .collect();
        let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut scored: Vec<f64> = logs.iter().map(|log| (log - top).exp()).collect();
        let sum: f64 = scored.iter().sum();
        scored.iter_mut().for_each(|weight| *weight /= sum);
        let mechanisms: Vec<_> = (search.scored.iter())
            .map(|scored| search::mechanisms(bench, &scored.set))
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
    fn likeliest(&self, among: impl Iterator<Item = usize>) -> Option<usize> {
        let (whole, scored) = (&self.whole, &self.scored);
        among.max_by(|a, b| {
            (whole[*a].total_cmp(&whole[*b])).then(scored[*a].total_cmp(&scored[*b]))
        })
    }

    /// Of all sets.
    fn best(&self) -> usize {
        self.likeliest(0..self.scored.len()).unwrap_or(0)
    }

    /// Probability that a candidate is in the true set.
    fn candidates(&self, search: &Search) -> BTreeMap<usize, f64> {
        let mut sums = BTreeMap::new();
        for (scored, weight) in search.scored.iter().zip(&self.scored) {
            for candidate in &scored.set {
                *sums.entry(*candidate).or_insert(0.0) += weight;
            }
        }
        sums
    }

    /// Probability that an effect is missing, on whatever target.
    fn ids(&self, bench: &Bench<'_>, search: &Search) -> BTreeMap<Id, f64> {
        let mut sums = BTreeMap::new();
        for (scored, weight) in search.scored.iter().zip(&self.scored) {
            let mut ids: Vec<Id> = scored
                .set
                .iter()
                .map(|candidate| bench.candidates[*candidate].effect)
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

struct Decision {
    outcome: Outcome,
    chosen: usize,
    named: Vec<(Id, String)>,
    confusion: Vec<Id>,
    /// Two refitted sets that an experiment should tell apart.
    apart: Option<(usize, usize)>,
    unexplained: f64,
    p_value: f64,
}

fn decide(bench: &Bench<'_>, search: &Search, weights: &Weights, adequacy: Adequacy) -> Decision {
    let empty = &search.scored[0];
    let best = weights.best();
    let least = &search.scored[best];
    let mut decision = Decision {
        outcome: Outcome::NoGap,
        chosen: 0,
        named: Vec::new(),
        confusion: Vec::new(),
        apart: None,
        unexplained: left_over(bench, &empty.fit, &least.fit),
        p_value: adequacy.p_value,
    };
    if adequacy.p_value <= INADEQUATE {
        decision.outcome = Outcome::Unknown;
        decision.chosen = best;
        return decision;
    }
    // The set of highest probability, cut back until its mean error is small.
    let ids = weights.ids(bench, search);
    let set_ids: Vec<Id> = {
        let mut set: Vec<Id> = least
            .set
            .iter()
            .map(|candidate| bench.candidates[*candidate].effect)
            .collect();
        set.sort_by(|a, b| ids[b].total_cmp(&ids[a]));
        set.dedup();
        set
    };
    let mut kept = 0;
    let mut error = 0.0;
    for id in &set_ids {
        error += 1.0 - ids[id];
        if error / (kept + 1) as f64 > ERROR {
            break;
        }
        kept += 1;
    }
    let rivals = rivals(bench, search, weights, best);
    let undecided: Vec<Id> = rivals
        .iter()
        .flat_map(|rival| {
            search.scored[*rival]
                .set
                .iter()
                .map(|candidate| bench.candidates[*candidate].effect)
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
                    .any(|candidate| bench.candidates[*candidate].effect == **id)
            })
        })
        .copied()
        .collect();
    let something = 1.0 - weights.scored[0];
    if least.set.is_empty() || (kept == 0 && something < 1.0 - ERROR) {
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
                .filter(|(_, p)| **p > ERROR)
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
                let id = bench.candidates[*candidate].effect;
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
        .filter(|candidate| decided.contains(&bench.candidates[**candidate].effect))
        .flat_map(|candidate| {
            let of = &bench.candidates[*candidate];
            of.targets
                .iter()
                .map(move |target| (of.effect, target.clone()))
        })
        .collect();
    // Only a set that was refitted can be added: find the likeliest that holds exactly what is decided.
    if decided.len() < set_ids.len() {
        let mut wanted = search::mechanisms(bench, &least.set);
        wanted.retain(|(effect, _)| decided.contains(effect));
        let exact = (0..search.scored.len())
            .filter(|at| search::mechanisms(bench, &search.scored[*at].set) == wanted);
        decision.chosen = weights.likeliest(exact).unwrap_or(best);
    }
    decision
}

/// Refitted sets of no more effects than the best whose outputs are as near to the data.
fn rivals(bench: &Bench<'_>, search: &Search, weights: &Weights, best: usize) -> Vec<usize> {
    let of = &search.scored[best];
    let ids = |scored: &Scored| -> Vec<Id> {
        let mut ids: Vec<Id> = scored
            .set
            .iter()
            .map(|candidate| bench.candidates[*candidate].effect)
            .collect();
        ids.sort_unstable();
        ids
    };
    // Uncertain numbers of the nominal may be bent to mimic an effect, at the price of their priors.
    let charge = |at: usize| {
        let scored = &search.scored[at];
        scored.fit.misfit / search.factor + scored.fit.penalty
    };
    let probable = |at: usize| weights.whole[at] > ERROR * weights.whole[best];
    // The likeliest of its forms speaks for an explanation.
    let speaks = |at: usize| {
        let of = search::mechanisms(bench, &search.scored[at].set);
        (0..search.scored.len()).all(|other| {
            weights.scored[other] <= weights.scored[at]
                || search::mechanisms(bench, &search.scored[other].set) != of
        })
    };
    (1..search.scored.len())
        .filter(|at| {
            let other = &search.scored[*at];
            *at != best
                && other.set.len() <= of.set.len()
                && ids(other) != ids(of)
                && charge(*at) - charge(best) < CONFUSION
                && probable(*at)
                && speaks(*at)
        })
        .collect()
}

/// Part of the excess that a fit leaves.
fn left_over(bench: &Bench<'_>, empty: &Fit, best: &Fit) -> f64 {
    let fitted = (2 * bench.model.nv * bench.segments.len()) as f64;
    let noise = (best.readings as f64 - fitted).max(1.0);
    let excess = (empty.misfit - noise).max(f64::MIN_POSITIVE);
    ((best.misfit - noise) / excess).clamp(0.0, 1.0)
}

/// All effects with a probability worth telling, with values from the best set that holds each.
fn listed(
    bench: &Bench<'_>,
    search: &Search,
    weights: &Weights,
    decision: &Decision,
) -> Vec<FittedEffect> {
    let probabilities = weights.candidates(search);
    let chosen = &search.scored[decision.chosen].set;
    // One effect may have several forms: said once, in the chosen or else the likeliest.
    let forms_of = |candidate: usize| {
        let of = &bench.candidates[candidate];
        probabilities
            .iter()
            .map(|(other, p)| (*other, *p))
            .filter(move |(other, _)| {
                *other != candidate && bench.candidates[*other].mechanism() == of.mechanism()
            })
    };
    let stands_for_all = |candidate: usize, p: f64| {
        chosen.contains(&candidate)
            || forms_of(candidate).all(|(other, of_other)| {
                !chosen.contains(&other) && (of_other, other) < (p, candidate)
            })
    };
    let mut effects: Vec<FittedEffect> = probabilities
        .iter()
        .filter(|(candidate, p)| stands_for_all(**candidate, **p))
        .map(|(candidate, p)| {
            let of_all = *p + forms_of(*candidate).map(|(_, p)| p).sum::<f64>();
            (candidate, of_all)
        })
        .filter(|(candidate, p)| *p > NEGLIGIBLE || chosen.contains(candidate))
        .flat_map(|(candidate, p)| {
            let holder = if chosen.contains(candidate) {
                decision.chosen
            } else {
                (0..search.scored.len())
                    .filter(|at| search.scored[*at].set.contains(candidate))
                    .max_by(|a, b| weights.scored[*a].total_cmp(&weights.scored[*b]))
                    .unwrap_or(0)
            };
            let parameters =
                parameters(bench, &search.scored[holder].fit, *candidate, search.factor);
            let of = &bench.candidates[*candidate];
            of.targets.iter().map(move |target| FittedEffect {
                effect: of.effect,
                target: target.clone(),
                probability: p.clamp(0.0, 1.0),
                surrogate: decision.outcome == Outcome::Unknown,
                parameters: parameters.clone(),
            })
        })
        .collect();
    effects.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    effects
}

fn ranking(bench: &Bench<'_>, search: &Search, weights: &Weights) -> Vec<Hypothesis> {
    let pairs = |set: &[usize]| -> Vec<(Id, String)> {
        set.iter()
            .map(|candidate| {
                let of = &bench.candidates[*candidate];
                (of.effect, of.targets.join(", "))
            })
            .collect()
    };
    let empty = &search.scored[0];
    let mut ranking: Vec<Hypothesis> = search
        .scored
        .iter()
        .enumerate()
        .map(|(at, scored)| Hypothesis {
            effects: pairs(&scored.set),
            log_evidence: weights.evidence[at] - weights.evidence[0],
            probability: weights.scored[at],
            unexplained: left_over(bench, &empty.fit, &scored.fit),
            refitted: true,
        })
        .collect();
    // Forms of one effect are one hypothesis, with the evidence of the likeliest.
    ranking.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let mut ranking = merged(ranking);
    ranking.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let refitted = |set: &[usize]| {
        let of = search::mechanisms(bench, set);
        let mut scored = search.scored.iter();
        scored.any(|scored| search::mechanisms(bench, &scored.set) == of)
    };
    ranking.extend(
        search::firsts(bench, search.linear.iter(), |of| &of.0)
            .into_iter()
            .filter(|(set, _)| !refitted(set))
            .take(SHOWN)
            .map(|(set, gain)| Hypothesis {
                effects: pairs(set),
                log_evidence: *gain,
                probability: 0.0,
                unexplained: 1.0,
                refitted: false,
            }),
    );
    ranking.truncate(SHOWN);
    ranking
}

/// One row for all rows of the same effects: the first, with the probabilities of all.
fn merged(rows: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let mut merged: Vec<Hypothesis> = Vec::new();
    for row in rows {
        match merged.iter_mut().find(|of| of.effects == row.effects) {
            Some(of) => of.probability += row.probability,
            None => merged.push(row),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_the_same_effects_are_one() {
        let row = |effect: Id, log_evidence: f64, probability: f64| Hypothesis {
            effects: vec![(effect, "hull".to_owned())],
            log_evidence,
            probability,
            unexplained: 0.0,
            refitted: true,
        };
        let rows = merged(vec![
            row(Id::NetBuoyancy, 7.0, 0.4),
            row(Id::Payload, 6.0, 0.35),
            row(Id::NetBuoyancy, 5.0, 0.25),
        ]);
        let found: Vec<_> = (rows.iter())
            .map(|row| (row.effects[0].0, row.log_evidence, row.probability))
            .collect();
        assert_eq!(
            found,
            [(Id::NetBuoyancy, 7.0, 0.65), (Id::Payload, 6.0, 0.35)]
        );
    }
}
