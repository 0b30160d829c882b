//! Name: which effects are missing, how surely, and what else it could be.

use hydro_effects::Id;

use crate::{
    error::GapError,
    likelihood::explanation::Explanation,
    output::{
        records::{Hypothesis, Named},
        verdict::{FittedEffect, FittedParameter, Outcome},
    },
    problem::candidates::Candidate,
    progress::Watch,
    stage::{
        calibration::calibrate,
        decision::{Decision, decide},
        doubts, experiment_design,
    },
};

/// Schema of [`Named`].
const SCHEMA: &str = "hydro-gap-name/1";

/// Sets shown.
const SHOWN: usize = 20;

/// Result of the name stage.
#[derive(Debug)]
pub struct Naming {
    /// For the file.
    pub named: Named,
    /// The chosen set; the empty one where nothing is.
    pub(crate) chosen: usize,
}

/// Weighs the sets and decides.
///
/// # Errors
/// The plant refuses, or a stop was asked for.
pub fn name(explanation: &Explanation<'_>, watch: &Watch<'_>) -> Result<Naming, GapError> {
    let calibration = calibrate(explanation);
    let decision = decide(explanation, &calibration, watch)?;
    let effects = listed(explanation, &decision);
    let is_named = |effect: &&FittedEffect| effect.explained.is_some();
    let chosen = effects.iter().filter(is_named).cloned().collect();
    let stand_ins = stand_ins(explanation, &decision, &effects);
    let apart = decision
        .apart
        .map(|(one, other)| experiment_design::next(explanation.problem, &one, &other, watch));
    let mut remarks = decision.remarks;
    if decision.outcome != Outcome::Unknown {
        remarks.extend(doubts::left_out(explanation));
        remarks.extend(doubts::far_numbers(explanation, decision.chosen));
    }
    let named = Named {
        schema: SCHEMA.to_owned(),
        outcome: decision.outcome,
        chosen,
        stand_ins,
        effects,
        confusion_set: decision.confusion,
        next_experiment: apart.transpose()?,
        ranking: ranking(explanation),
        nuisances: explanation.nuisances(decision.chosen),
        explained: decision.explained,
        calibration,
        remarks,
    };
    Ok(Naming {
        named,
        chosen: decision.chosen,
    })
}

/// All effects with a probability worth telling, with values from the best set that holds each.
fn listed(explanation: &Explanation<'_>, decision: &Decision) -> Vec<FittedEffect> {
    let problem = &explanation.problem;
    let probabilities = explanation.candidates();
    let chosen = &explanation.sets[decision.chosen].set;
    // One effect may have several forms: said once, in the chosen or else the likeliest.
    let forms_of = |candidate: usize| {
        let of = &problem.candidates[candidate];
        probabilities
            .iter()
            .map(|(other, p)| (*other, *p))
            .filter(move |(other, _)| {
                *other != candidate && problem.candidates[*other].mechanism() == of.mechanism()
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
            *p > problem.settings.options.name.negligible || chosen.contains(candidate)
        })
        .flat_map(|(candidate, p)| {
            let holder = if chosen.contains(candidate) {
                Some(decision.chosen)
            } else {
                let mut sets = explanation.sets.iter();
                sets.position(|of| of.set.contains(candidate))
            };
            let parameters =
                holder.map_or_else(Vec::new, |set| explanation.parameters(set, *candidate));
            let of = &problem.candidates[*candidate];
            let explained = decision.named.get(candidate).copied();
            let acting = acting_on(of, &parameters).into_iter();
            acting.map(move |at| FittedEffect {
                effect: of.effect,
                target: of.targets[at].clone(),
                probability: p.clamp(0.0, 1.0),
                surrogate: decision.outcome == Outcome::Unknown,
                explained,
                parameters: of.of_target(at, &parameters).to_vec(),
            })
        })
        .collect();
    effects.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    each_once(effects)
}

/// One entry an effect and target: an effect on a joint alone and one on all joints are never in one set. What is named stands first,
/// else the likeliest.
fn each_once(effects: Vec<FittedEffect>) -> Vec<FittedEffect> {
    let mut once: Vec<FittedEffect> = Vec::new();
    for of in effects {
        let is_it = |had: &&mut FittedEffect| (had.effect, &had.target) == (of.effect, &of.target);
        let Some(had) = once.iter_mut().find(is_it) else {
            once.push(of);
            continue;
        };
        let probability = (had.probability + of.probability).min(1.0);
        let is_better =
            had.parameters.is_empty() || (had.explained.is_none() && of.explained.is_some());
        if is_better && !of.parameters.is_empty() {
            *had = of;
        }
        had.probability = probability;
    }
    once
}

/// Places of the targets on which an effect acts. Of one that has values of each target's own they are those whose interval does
/// not hold none, if there are any: friction in six joints may be friction in three.
fn acting_on(of: &Candidate, fitted: &[FittedParameter]) -> Vec<usize> {
    let all = 0..of.targets.len();
    let acts = |at: &usize| {
        let own = of.of_target(*at, fitted).iter();
        let mut own = own.zip(of.of_target(*at, &of.parameters));
        own.any(|(fitted, p)| !p.shapes && !(fitted.ci95[0]..=fitted.ci95[1]).contains(&p.null))
    };
    let acting: Vec<usize> = all.clone().filter(acts).collect();
    match of.is_apart && !acting.is_empty() {
        true => acting,
        false => all.collect(),
    }
}

/// The effects that stand for what is undecided, as they are listed.
fn stand_ins(
    explanation: &Explanation<'_>,
    decision: &Decision,
    effects: &[FittedEffect],
) -> Vec<FittedEffect> {
    let candidates = decision.stand_ins.iter();
    let candidates = candidates.map(|of| &explanation.problem.candidates[*of]);
    let listed = |of: &&FittedEffect| {
        let mut candidates = candidates.clone();
        candidates.any(|one| one.effect == of.effect && one.targets.contains(&of.target))
    };
    effects.iter().filter(listed).cloned().collect()
}

/// Sets, the likeliest first.
fn ranking(explanation: &Explanation<'_>) -> Vec<Hypothesis> {
    let nothing = explanation.sets[explanation.nothing()].log_posterior;
    let pairs = |set: &[usize]| -> Vec<(Id, String)> {
        set.iter()
            .flat_map(|candidate| explanation.problem.candidates[*candidate].mechanisms())
            .map(|(effect, targets)| (effect, targets.join(", ")))
            .collect()
    };
    (explanation.sets.iter().enumerate())
        .take(SHOWN)
        .map(|(row, set)| Hypothesis {
            effects: pairs(&set.set),
            log_evidence: set.log_posterior - nothing,
            probability: set.probability,
            unexplained: 1.0 - explanation.explained(row, &[]),
            refitted: explanation.is_linearised_about(row),
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use hydro_effects::{
        card::{JointScale, Target},
        effect,
    };

    use super::*;

    fn fitted(value: f64, ci95: [f64; 2]) -> FittedParameter {
        serde_json::from_value(serde_json::json!({
            "name": "damping", "value": value, "unit": "N m s/rad", "ci95": ci95,
        }))
        .unwrap()
    }

    #[test]
    fn of_an_effect_on_all_joints_those_on_which_it_acts_are_told() {
        let joint = Target::Joint(JointScale {
            inertia: 1.0,
            armature: 0.0,
            damping: 0.0,
            torque: 1.0,
            speed: 1.0,
            travel: 1.0,
            middle: 0.0,
            slides: false,
            driven: true,
        });
        let damping = effect(Id::JointDamping).parameters(&joint).swap_remove(0);
        let targets = ["shoulder", "elbow", "wrist"];
        let mut of = Candidate {
            effect: Id::JointDamping,
            targets: targets.map(str::to_owned).to_vec(),
            parameters: vec![damping; 3],
            left_out: Vec::new(),
            is_apart: true,
        };
        let [sure, unsure] = [fitted(0.4, [0.3, 0.5]), fitted(0.1, [0.0, 0.3])];
        let some = [sure.clone(), unsure.clone(), sure.clone()];
        assert_eq!(acting_on(&of, &some), [0, 2]);
        // Where none is sure, something is missing all the same.
        let none = [unsure.clone(), unsure.clone(), unsure.clone()];
        assert_eq!(acting_on(&of, &none), [0, 1, 2]);
        of.is_apart = false;
        assert_eq!(acting_on(&of, &[unsure]), [0, 1, 2]);
    }

    #[test]
    fn an_effect_on_a_target_is_listed_once() {
        let of =
            |target: &str, probability: f64, explained: Option<f64>, value: f64| FittedEffect {
                effect: Id::JointDamping,
                target: target.to_owned(),
                probability,
                surrogate: false,
                explained,
                parameters: vec![fitted(value, [0.0, 1.0])],
            };
        let listed = each_once(vec![
            of("elbow", 0.6, None, 1.0),
            of("wrist", 0.4, Some(0.9), 2.0),
            of("elbow", 0.3, Some(0.9), 3.0),
            of("wrist", 0.1, None, 4.0),
        ]);
        let told: Vec<_> = listed
            .iter()
            .map(|of| (of.target.as_str(), of.parameters[0].value))
            .collect();
        // What is named gives the values.
        assert_eq!(told, [("elbow", 3.0), ("wrist", 2.0)]);
        assert!((listed[0].probability - 0.9).abs() < 1e-12);
        assert!((listed[1].probability - 0.5).abs() < 1e-12);
    }
}
