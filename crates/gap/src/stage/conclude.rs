//! The verdict from what the stages found.

use hydro_effects::Id;

use crate::output::{
    records::{Added, Found, Named, Verified},
    verdict::{self, FittedEffect, Gap, Outcome, Patch, Verdict},
};

/// Puts the answer together. Nothing is added that held-out trials do not confirm, and nothing is named that they contradict.
pub fn conclude(
    found: &Found,
    named: &Named,
    added: Option<&Added>,
    verified: Option<&Verified>,
) -> Verdict {
    let written = added.filter(|added| added.is_written());
    let contradicted =
        named.outcome == Outcome::Named && verified.is_some_and(|verified| verified.contradicted);
    let aside = contradicted.then(|| put_aside(named));
    let named = aside.as_ref().unwrap_or(named);
    let accepted = verified.is_some_and(|verified| verified.accepted) && written.is_some();
    let refused_because = match (named.outcome, verified) {
        (Outcome::Named, None) if found.held_out_trials.is_empty() => Some(
            "there is a single trial, so none could be held out: name and intervals are given, a \
             reduction is not claimed and nothing was added"
                .to_owned(),
        ),
        (Outcome::Unknown, None) if written.is_some() => Some(
            "there is a single trial, so none could be held out: a learned residual that nothing confirms \
             is not added"
                .to_owned(),
        ),
        (_, Some(verified)) if written.is_some() => verified.refused_because.clone(),
        // Nothing was even tried.
        (Outcome::Unknown, _) if !found.held_out_trials.is_empty() => {
            added.and_then(|added| added.remarks.first().cloned())
        }
        _ if found.held_out_trials.is_empty() => Some(
            "there is a single trial, so none could be held out: the answer is of that trial alone, and no \
             reduction is claimed"
                .to_owned(),
        ),
        _ => None,
    };
    let ids = match named.outcome == Outcome::Named && accepted {
        true => ids_of(&named.chosen),
        false => Vec::new(),
    };
    let nothing = Gap {
        metric: "nrmse".to_owned(),
        before: None,
        after: None,
        reduction: None,
        ci95: None,
        n_holdout_trials: 0,
        per_sensor: Default::default(),
    };
    Verdict {
        schema: verdict::SCHEMA.to_owned(),
        verdict: named.outcome,
        named: ids,
        effects: named.effects.clone(),
        medium: found.medium,
        explained: named.explained,
        unexplained: match named.outcome {
            Outcome::NoGap => None,
            _ => Some(1.0 - named.explained.unwrap_or(0.0)),
        },
        calibration: named.calibration.clone(),
        confusion_set: named.confusion_set.clone(),
        next_experiment: named.next_experiment.clone(),
        places: found.places.clone(),
        regime: found.regime.clone(),
        gap: verified.map_or(nothing, |verified| verified.gap.clone()),
        verified: accepted,
        contradicted,
        doubts: named.remarks.clone(),
        refused_because,
        patch: written.filter(|_| accepted).and_then(|added| {
            Some(Patch {
                model: added.model.clone()?,
                sensors: added.sensors.clone(),
                stand_ins: ids_of(&named.stand_ins),
            })
        }),
    }
}

/// The answer where held-out trials contradict the name: its effects only stand for what is missing.
fn put_aside(named: &Named) -> Named {
    let mut aside = Named {
        outcome: Outcome::Unknown,
        explained: None,
        confusion_set: Vec::new(),
        next_experiment: None,
        ..named.clone()
    };
    aside.effects.iter_mut().for_each(|of| of.surrogate = true);
    aside
}

/// Effects, each once.
fn ids_of(effects: &[FittedEffect]) -> Vec<Id> {
    let mut ids = Vec::new();
    for effect in effects {
        if !ids.contains(&effect.effect) {
            ids.push(effect.effect);
        }
    }
    ids
}
