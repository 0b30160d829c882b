//! The decision: named, confusable, unknown, or no gap.

use std::collections::BTreeMap;

use hydro_effects::Id;

use crate::{
    error::GapError,
    likelihood::explanation::{Explanation, SetPosterior},
    output::verdict::{Calibration, Outcome},
    problem::point::Point,
    progress::Watch,
    stage::{
        doubts,
        timing::{self, Timing},
    },
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
    /// Members of the chosen set that stand for what is undecided: something beyond the named is missing, whichever it is.
    pub(crate) stand_ins: Vec<usize>,
    /// Two explanations that an experiment should tell apart.
    pub(crate) apart: Option<(Point, Point)>,
    /// Sentences for the reader.
    pub(crate) remarks: Vec<String>,
}

/// Decides by probabilities: of any gap, of every effect given that there is one, and by what the set explains.
///
/// # Errors
/// The plant refuses, or a stop was asked for.
pub(crate) fn decide(
    explanation: &Explanation<'_>,
    calibration: &Calibration,
    watch: &Watch<'_>,
) -> Result<Decision, GapError> {
    let options = &explanation.problem.settings.options.name;
    let nothing = explanation.nothing();
    let (agreement, unmodelled) = explanation.without_effects();
    let mut decision = Decision {
        outcome: Outcome::NoGap,
        chosen: nothing,
        named: BTreeMap::new(),
        explained: None,
        confusion: Vec::new(),
        stand_ins: Vec::new(),
        apart: None,
        remarks: Vec::new(),
    };
    if agreement > options.agreement || calibration.alarm > calibration.alarm_level {
        return Ok(decision);
    }
    decision.outcome = Outcome::Unknown;
    let gap = 1.0 - agreement;
    let Some(best) = explanation
        .best()
        .filter(|_| unmodelled < options.named * gap)
    else {
        return Ok(decision);
    };
    let timing = timing::resolve(explanation, best, watch)?;
    let best = timing.as_ref().map_or(best, |of| of.best);
    decision.chosen = best;
    let explained = |without: &[usize]| explanation.explained(best, without);
    let whole = explained(&[]);
    decision.explained = Some(whole);
    if whole < options.explained {
        return Ok(decision);
    }
    decision
        .remarks
        .extend(doubts::values_at_an_edge(explanation, best));
    if !decision.remarks.is_empty() {
        return Ok(decision);
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
            // Of one mechanism the probability is that of all its members.
            let p = match timing.as_ref().filter(|_| timing::is_member(id(of))) {
                Some(timing) if timing.is_told => timing.probability / gap,
                Some(_) => 0.0,
                None => probabilities.get(&id(of)).copied().unwrap_or(0.0),
            };
            p >= options.named
        })
        .collect();
    if sure.len() < set.len() {
        let decided: Vec<Id> = sure.iter().map(id).collect();
        decision.confusion = confusion(&probabilities, &decided, options.error);
        let own = explanation.effects(set);
        let rival = (0..explanation.sets.len())
            .find(|row| *row != nothing && explanation.effects(&explanation.sets[*row].set) != own);
        decision.apart = rival.map(|rival| (explanation.point(best), explanation.point(rival)));
        if let Some(timing) = timing.filter(|of| !of.is_told) {
            open_members(explanation, timing, &mut decision);
        }
        let beyond = |of: &&SetPosterior| {
            let effects = explanation.effects(&of.set);
            effects.iter().any(|of| !decided.contains(of))
        };
        let beyond = explanation.sets.iter().filter(beyond);
        if beyond.map(|of| of.probability).sum::<f64>() >= options.named * gap {
            decision.stand_ins = others(set, &sure);
        }
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
        if decision.outcome == Outcome::Unknown {
            decision.stand_ins.clear();
        }
        return Ok(decision);
    }
    decision.outcome = Outcome::Named;
    let kept: Vec<usize> = decision.named.keys().copied().collect();
    if decision.stand_ins.is_empty() {
        match explanation.sets.iter().position(|of| of.set == kept) {
            Some(exact) => decision.chosen = exact,
            // What was not looked at without the others is added with them.
            None => decision.stand_ins = others(set, &kept),
        }
    }
    decision.explained = Some(explained(&others(set, &kept)));
    Ok(decision)
}

/// Members of a set that are not among some.
fn others(set: &[usize], some: &[usize]) -> Vec<usize> {
    let others = set.iter().copied();
    others.filter(|of| !some.contains(of)).collect()
}

/// Both members of a mechanism stand as what it could be, with the experiment that tells them apart.
fn open_members(explanation: &Explanation<'_>, timing: Timing, decision: &mut Decision) {
    for id in timing.members {
        if !decision.confusion.contains(&id) {
            decision.confusion.push(id);
        }
    }
    decision.apart = Some((explanation.point(timing.best), timing.other));
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
