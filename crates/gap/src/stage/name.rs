//! Name: which effect is missing, how surely, and what else it could be.

use hydro_effects::Id;

use crate::{
    error::GapError,
    fit::{
        intervals::{nuisances, parameters},
        linearized_problem::LinearizedProblem,
    },
    output::{
        records::{Hypothesis, Named},
        verdict::{FittedEffect, Outcome},
    },
    problem::problem::Problem,
    progress::Watch,
    select::{
        evidence::{adequate, firsts, mechanisms},
        search::{Search, search},
    },
    stage::{
        decision::{Decision, decide, unexplained_part},
        experiment_design,
        posterior::Weights,
    },
};

/// Schema of [`Named`].
const SCHEMA: &str = "hydro-gap-name/1";

/// Sets shown.
const SHOWN: usize = 20;
/// Result of the name stage, with the fit that `add` writes down.
#[derive(Debug)]
pub struct Naming {
    /// For the file.
    pub named: Named,
    pub(crate) search: Search,
    /// The refitted set that was chosen; the empty one where nothing is.
    pub(crate) chosen: usize,
}

/// Searches, weighs and decides.
///
/// # Errors
/// The plant refuses, or a stop was asked for.
pub fn name(
    problem: &Problem<'_>,
    linearized: &LinearizedProblem<'_>,
    watch: &Watch<'_>,
) -> Result<Naming, GapError> {
    let mut search = search(linearized, problem.settings.seed, watch)?;
    let weights = Weights::new(linearized, &search);
    let best = weights.best();
    let adequacy = adequate(
        linearized,
        &mut search.scored[best],
        problem.settings.seed,
        watch,
    )?;
    let decision = decide(linearized, &search, &weights, adequacy);
    let scored = &search.scored[decision.chosen];
    let effects = listed(linearized, &search, &weights, &decision);
    let chosen = effects
        .iter()
        .filter(|effect| {
            decision
                .named
                .contains(&(effect.effect, effect.target.clone()))
        })
        .cloned()
        .collect();
    let nuisances = nuisances(linearized, &scored.fit, search.inflation);
    let apart = decision.apart.map(|(one, other)| {
        let [one, other] = [one, other].map(|of| &search.scored[of].fit.point);
        experiment_design::next(linearized, one, other, &problem.commands, watch)
    });
    let next_experiment = apart.transpose()?;
    let named = Named {
        schema: SCHEMA.to_owned(),
        outcome: decision.outcome,
        chosen,
        effects,
        confusion_set: decision.confusion,
        next_experiment,
        ranking: ranking(linearized, &search, &weights),
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

/// All effects with a probability worth telling, with values from the best set that holds each.
fn listed(
    linearized: &LinearizedProblem<'_>,
    search: &Search,
    weights: &Weights,
    decision: &Decision,
) -> Vec<FittedEffect> {
    let probabilities = weights.candidates(search);
    let chosen = &search.scored[decision.chosen].set;
    // One effect may have several forms: said once, in the chosen or else the likeliest.
    let forms_of = |candidate: usize| {
        let of = &linearized.problem.candidates[candidate];
        probabilities
            .iter()
            .map(|(other, p)| (*other, *p))
            .filter(move |(other, _)| {
                *other != candidate
                    && linearized.problem.candidates[*other].mechanism() == of.mechanism()
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
        .filter(|(candidate, p)| {
            *p > linearized.problem.options.name.negligible || chosen.contains(candidate)
        })
        .flat_map(|(candidate, p)| {
            let holder = if chosen.contains(candidate) {
                decision.chosen
            } else {
                (0..search.scored.len())
                    .filter(|at| search.scored[*at].set.contains(candidate))
                    .max_by(|a, b| weights.scored[*a].total_cmp(&weights.scored[*b]))
                    .unwrap_or(0)
            };
            let parameters = parameters(
                linearized,
                &search.scored[holder].fit,
                *candidate,
                search.inflation,
            );
            let of = &linearized.problem.candidates[*candidate];
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

fn ranking(
    linearized: &LinearizedProblem<'_>,
    search: &Search,
    weights: &Weights,
) -> Vec<Hypothesis> {
    let pairs = |set: &[usize]| -> Vec<(Id, String)> {
        set.iter()
            .map(|candidate| {
                let of = &linearized.problem.candidates[*candidate];
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
            unexplained: unexplained_part(linearized, &empty.fit, &scored.fit),
            refitted: true,
        })
        .collect();
    // Forms of one effect are one hypothesis, with the evidence of the likeliest.
    ranking.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let mut ranking = merged(ranking);
    ranking.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let refitted = |set: &[usize]| {
        let of = mechanisms(linearized, set);
        let mut scored = search.scored.iter();
        scored.any(|scored| mechanisms(linearized, &scored.set) == of)
    };
    ranking.extend(
        firsts(linearized, search.linear.iter(), |of| &of.0)
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
