//! The verdict in one sentence, for page and terminal. Names from the user's files stand between backticks.

use hydro_effects::{Id, TargetKind, catalogue};
use hydro_gap::{
    records::Record,
    verdict::{FittedEffect, Gap, Outcome, Place, Regime, Verdict},
};

use super::numbers::{bare_percent, number, part_of_excess, percent, probability};

/// Kind of a verdict, told apart also by what the held-out trials said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerdictKind {
    /// Named and confirmed by held-out trials.
    Verified,
    /// Named; no trial was held out.
    Unchecked,
    /// Named and refused by held-out trials.
    Refused,
    /// What fits best predicts held-out trials worse than the nominal.
    Contradicted,
    /// Several effects explain the difference.
    Confusable,
    /// No effect is missing.
    NoGap,
    /// The missing effect is not in the catalogue.
    Unknown,
}

impl VerdictKind {
    /// The kind of a verdict.
    pub fn from_verdict(verdict: &Verdict) -> Self {
        match verdict.verdict {
            Outcome::Named if verdict.verified => Self::Verified,
            Outcome::Named if verdict.gap.n_holdout_trials == 0 => Self::Unchecked,
            Outcome::Named => Self::Refused,
            Outcome::Confusable => Self::Confusable,
            Outcome::NoGap => Self::NoGap,
            Outcome::Unknown if verdict.contradicted => Self::Contradicted,
            Outcome::Unknown => Self::Unknown,
        }
    }

    /// Label above the sentence.
    pub fn label(self) -> &'static str {
        match self {
            Self::Verified => "Named and verified",
            Self::Unchecked => "Named, not verified",
            Self::Refused => "Named, refused by held-out trials",
            Self::Contradicted => "Unknown: held-out trials contradict the fit",
            Self::Confusable => "Cannot tell apart",
            Self::NoGap => "No gap",
            Self::Unknown => "Outside the catalogue",
        }
    }
}

/// Sentence on the gain of refitting the nominal model alone; empty where it is not known.
pub(super) fn recalibration(record: &Record) -> String {
    let before = record.verdict.gap.before;
    let alone = record.verified.as_ref().and_then(|of| of.recalibrated);
    match (before, alone) {
        (Some(before), Some(alone)) if record.is_patched() && before > 0.0 && alone.is_finite() => {
            let cut = f64::max(1.0 - alone / before, 0.0);
            format!(
                "The patched model holds the nominal's numbers refitted too; refitted alone, without an addition, \
                 they cut the error by {}.",
                percent(cut)
            )
        }
        _ => String::new(),
    }
}

/// Least probability at which another target of the same effect is mentioned.
const ELSEWHERE: f64 = 0.05;
/// Rounding error of a sum of probabilities.
const ROUNDING: f64 = 1e-6;

/// The effect in a sentence, after "the model lacks".
fn phrase(id: Id) -> &'static str {
    catalogue::effect(id).card().phrase
}

/// The effect's name for people.
pub fn effect_name(id: Id) -> &'static str {
    let phrase = phrase(id);
    phrase
        .strip_prefix("a ")
        .or_else(|| phrase.strip_prefix("an "))
        .unwrap_or(phrase)
}

/// Effect and target.
pub fn effect_on(id: Id, target: &str) -> String {
    on(effect_name(id), target)
}

fn on(effect: &str, target: &str) -> String {
    if target.is_empty() {
        effect.to_owned()
    } else {
        format!("{effect} on {}", quoted(target))
    }
}

/// A name between backticks; a backtick of its own would end it.
fn quoted(name: &str) -> String {
    format!("`{}`", name.replace('`', "'"))
}

/// `a`, `a and b`, `a, b and c`.
fn listed(words: &[String], last: &str) -> String {
    match words {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., end] => format!("{} {last} {end}", first.join(", ")),
    }
}

/// The verdict in one sentence or two. `chosen` are the effects that were fitted together
/// ([`Named::chosen`](hydro_gap::records::Named)), which a verdict that is not verified does not hold.
pub fn headline(verdict: &Verdict, chosen: &[FittedEffect]) -> String {
    match VerdictKind::from_verdict(verdict) {
        VerdictKind::Verified => verified(verdict, chosen),
        VerdictKind::Unchecked => unchecked(verdict, chosen),
        VerdictKind::Refused => refused(verdict, chosen),
        VerdictKind::Contradicted => contradicted(verdict, chosen),
        VerdictKind::Confusable => confusable(verdict),
        VerdictKind::NoGap => no_gap(),
        VerdictKind::Unknown => unknown(verdict),
    }
}

/// True for an effect that one hypothesis may put on several targets; each is then an entry with the probability of all.
fn may_act_on_several(id: Id) -> bool {
    let target = catalogue::effect(id).card().target;
    matches!(target, TargetKind::Joint | TargetKind::Actuator)
}

/// The missing effects with their probabilities, and the pronoun for them.
fn missing(verdict: &Verdict, chosen: &[FittedEffect]) -> (String, &'static str) {
    let words: Vec<String> = if chosen.is_empty() {
        let ids = verdict.named.iter();
        ids.map(|id| phrase(*id).to_owned()).collect()
    } else {
        let word = |(index, effect): (usize, &FittedEffect)| {
            let label = if index == 0 { "probability " } else { "" };
            let stand_in = if effect.surrogate {
                "; only a stand-in for something outside the catalogue"
            } else {
                ""
            };
            // The effect may be certain and its target not: a current past a thigh is one past a calf.
            let elsewhere: Vec<&FittedEffect> = (verdict.effects.iter())
                .filter(|other| other.effect == effect.effect && other.probability > ELSEWHERE)
                .filter(|other| !may_act_on_several(other.effect))
                .filter(|other| {
                    (chosen.iter()).all(|of| of.effect != other.effect || of.target != other.target)
                })
                .collect();
            let sum = effect.probability + elsewhere.iter().map(|of| of.probability).sum::<f64>();
            // A sum above one: some sets have the effect on both targets, so the other is no alternative.
            let (elsewhere, sum) = if sum > 1.0 + ROUNDING {
                (Vec::new(), effect.probability)
            } else {
                (elsewhere, sum)
            };
            let or: String = (elsewhere.iter())
                .map(|other| format!(" or {}", quoted(&other.target)))
                .collect();
            format!(
                "{}{or} ({label}{}{stand_in})",
                on(phrase(effect.effect), &effect.target),
                probability(sum.min(1.0))
            )
        };
        chosen.iter().enumerate().map(word).collect()
    };
    let it = if words.len() > 1 { "them" } else { "it" };
    if words.is_empty() {
        return ("an effect".to_owned(), it);
    }
    (listed(&words, "and"), it)
}

fn verified(verdict: &Verdict, chosen: &[FittedEffect]) -> String {
    let (missing, it) = missing(verdict, chosen);
    format!(
        "The nominal model lacks {missing}; adding {it}, with the numbers of the nominal refitted, {}.{}{}",
        change(&verdict.gap),
        left(verdict, it),
        beside(verdict)
    )
}

/// Sentence on what the named effects explain and what is left; `it`: their pronoun as an object.
fn left(verdict: &Verdict, it: &str) -> String {
    let (Some(explained), Some(left)) = (verdict.explained, verdict.unexplained) else {
        return String::new();
    };
    let subject = if it == "it" {
        "It explains"
    } else {
        "They explain"
    };
    format!(
        " {subject} {} of the excess over noise; {} is left.",
        part_of_excess(explained),
        part_of_excess(left)
    )
}

/// Sentence on a further, undecided part.
fn beside(verdict: &Verdict) -> String {
    let held = match stand_ins(verdict).as_str() {
        "" => String::new(),
        of => format!("the patched model holds {of} for it"),
    };
    match (set(&verdict.confusion_set, "or").as_str(), held.as_str()) {
        ("", "") => String::new(),
        ("", held) => format!(" A further part is undecided; {held}."),
        (of, "") => format!(" A further part is {of}: the data cannot tell."),
        (of, held) => format!(" A further part is {of}: the data cannot tell; {held}."),
    }
}

/// Effects that the patched model holds for an undecided part, in words; empty where it holds none.
fn stand_ins(verdict: &Verdict) -> String {
    let patch = verdict.patch.as_ref();
    patch.map_or(String::new(), |patch| set(&patch.stand_ins, "and"))
}

fn set(ids: &[Id], last: &str) -> String {
    let words: Vec<String> = ids.iter().map(|id| phrase(*id).to_owned()).collect();
    listed(&words, last)
}

/// Change of the held-out error, as a predicate.
fn change(gap: &Gap) -> String {
    let trials = match gap.n_holdout_trials {
        1 => "1 held-out trial".to_owned(),
        n => format!("{n} held-out trials"),
    };
    let Some(reduction) = gap.reduction.filter(|value| value.is_finite()) else {
        return format!("was checked on {trials}");
    };
    let spread = gap.ci95.map_or(String::new(), |[low, high]| {
        format!(" (95 %: {} to {} %)", bare_percent(low), bare_percent(high))
    });
    let verb = if reduction >= 0.0 { "cuts" } else { "raises" };
    format!(
        "{verb} the error on {trials} by {}{spread}",
        percent(reduction.abs())
    )
}

/// Result of adding the likeliest of an undecided part, as a clause.
fn stood_in(verdict: &Verdict) -> String {
    match (stand_ins(verdict).as_str(), &verdict.refused_because) {
        ("", Some(why)) => format!("nothing was added: {}", clause(why)),
        ("", None) => "nothing was added".to_owned(),
        (of, _) => format!("adding {of}, the likeliest, {}", change(&verdict.gap)),
    }
}

/// A reason without its full stop.
fn clause(reason: &str) -> String {
    reason.trim().trim_end_matches('.').to_owned()
}

fn unchecked(verdict: &Verdict, chosen: &[FittedEffect]) -> String {
    let (missing, it) = missing(verdict, chosen);
    let added = if verdict.patch.is_none() {
        " and nothing was added"
    } else {
        ""
    };
    format!(
        "The nominal model lacks {missing}; no trial could be held out, so no reduction of the error is \
         claimed{added}.{}{}",
        left(verdict, it),
        beside(verdict)
    )
}

fn refused(verdict: &Verdict, chosen: &[FittedEffect]) -> String {
    let (missing, it) = missing(verdict, chosen);
    let why = verdict
        .refused_because
        .as_deref()
        .map_or(String::new(), |why| format!(": {}", clause(why)));
    format!(
        "The fit asks for {missing}, but the held-out trials refuse {it}{why}; nothing was added."
    )
}

fn contradicted(verdict: &Verdict, chosen: &[FittedEffect]) -> String {
    let (fits, _) = missing(verdict, chosen);
    format!(
        "Simulation and measurement disagree, and nothing can be named: what fits best, {fits}, {}; nothing was added.",
        change(&verdict.gap)
    )
}

fn confusable(verdict: &Verdict) -> String {
    let members: Vec<&FittedEffect> = verdict
        .effects
        .iter()
        .filter(|effect| verdict.confusion_set.contains(&effect.effect))
        .collect();
    let target_of = |id: &Id| {
        let member = members.iter().find(|effect| effect.effect == *id);
        member.map_or("", |effect| effect.target.as_str())
    };
    let ids = verdict.confusion_set.iter();
    let first = ids.clone().next().map_or("", target_of);
    // Said once where it is the same for all.
    let same = !first.is_empty() && members.iter().all(|effect| effect.target == first);
    let same = same && ids.clone().all(|id| target_of(id) == first);
    let words: Vec<String> = ids
        .map(|id| on(phrase(*id), if same { "" } else { target_of(id) }))
        .collect();
    let place = if same {
        format!(" on {}", quoted(first))
    } else {
        String::new()
    };
    let end = stood_in(verdict);
    match verdict.confusion_set.as_slice() {
        [] => format!("Something is missing, and the data cannot tell what; {end}."),
        // One name on several targets.
        [only] if members.len() > 1 => {
            let targets: Vec<String> = members.iter().map(|e| quoted(&e.target)).collect();
            format!(
                "The nominal model lacks {}, but the data cannot tell on which of {}; {end}.",
                phrase(*only),
                listed(&targets, "and")
            )
        }
        _ => format!(
            "The nominal model lacks {}{place}, but the data cannot tell which; {end}.",
            listed(&words, "or")
        ),
    }
}

fn no_gap() -> String {
    "No gap: simulation and measurement agree within sensor noise and the uncertainty of the nominal model."
        .to_owned()
}

fn unknown(verdict: &Verdict) -> String {
    let nearest = verdict
        .effects
        .iter()
        .find(|effect| effect.surrogate)
        .map_or(String::new(), |effect| {
            format!(
                "; the nearest, {}, would only stand in for it",
                on(phrase(effect.effect), &effect.target)
            )
        });
    let what = format!(
        "Something is missing that no effect of the catalogue explains with plausible values{nearest}"
    );
    if verdict.patch.is_some() && verdict.verified {
        return format!(
            "{what}. A learned residual was added, which is no name: it {}.",
            change(&verdict.gap)
        );
    }
    match (&verdict.refused_because, verdict.gap.after) {
        (Some(why), Some(_)) if verdict.gap.reduction.is_some_and(|of| of != 0.0) => format!(
            "{what}. A learned residual was tried, but the held-out trials refuse it: {}; nothing was added.",
            clause(why)
        ),
        _ => format!("{what}; nothing was added."),
    }
}

/// A place in words.
pub fn place(place: &Place) -> String {
    format!(
        "{}, {} to {} s in {}: {} of the excess",
        quoted(&place.sensor),
        number(place.t_start),
        number(place.t_end),
        quoted(&place.trial),
        percent(place.share)
    )
}

/// A regime in words.
pub fn regime(regime: &Regime) -> String {
    let share = percent(regime.share);
    if regime.samples > 0.0 {
        format!(
            "{}: {share} of the excess in {} of the samples",
            regime.rule,
            percent(regime.samples)
        )
    } else {
        format!("{}: {share} of the excess", regime.rule)
    }
}
