//! The verdict on the terminal, in at most ten lines.

use std::path::Path;

use hydro_gap::{
    records::{Added, Found, Named, Record},
    verdict::{FittedEffect, FittedParameter, Verdict},
};
use hydro_plugin::report::gap::{
    VerdictKind, by_trial, effect_name, effect_on, headline, interval, number, part_of_excess,
    percent, place, probability, regime, with_unit,
};

use super::results_folder::{PATCHED, REPORT};

/// Greatest number of lines.
const LINES: usize = 10;
/// Greatest number of parameters shown.
const PARAMETERS: usize = 6;
/// Greatest number of effects shown.
const EFFECTS: usize = 4;

/// The verdict, with the sentence of the page.
pub(super) fn ten_lines(record: &Record, out: &Path) -> String {
    let verdict = &record.verdict;
    let mut told = Vec::new();
    let mut line = |what: &'static str, words: String| {
        if !words.is_empty() {
            told.push((what, words));
        }
    };
    line(
        "verdict",
        VerdictKind::from_verdict(verdict).label().to_lowercase(),
    );
    line("where", verdict.places.first().map_or(String::new(), place));
    line("when", verdict.regime.first().map_or(String::new(), regime));
    let effects = verdict.effects.iter().take(EFFECTS).map(|effect| {
        format!(
            "{} {}",
            effect_on(effect.effect, &effect.target),
            probability(effect.probability)
        )
    });
    line("likeliest", joined(effects));
    line("explained", explained(verdict));
    line("values", values(record));
    line("error", error(record));
    line("doubtful", verdict.doubts.join("; "));
    line("next", verdict.next_experiment.clone().unwrap_or_default());
    let refused = verdict.refused_because.clone();
    let written = verdict.patch.as_ref().map_or_else(
        || refused.map_or(String::new(), |why| format!("nothing: {why}")),
        |_| out.join(PATCHED).display().to_string(),
    );
    line("written", written);
    line("page", out.join(REPORT).display().to_string());
    // The page has these with pictures.
    for spare in ["when", "where"] {
        if told.len() >= LINES {
            told.retain(|(what, _)| *what != spare);
        }
    }
    // Names from the user's files may hold control characters.
    let mut lines = vec![one_line(&headline(verdict, &record.named.chosen))];
    lines.extend(
        told.iter()
            .map(|(what, words)| one_line(&format!("{what:>11}  {words}"))),
    );
    lines.join("\n")
}

/// Shares of the excess that the named effects explain, together and each, and what is left.
fn explained(verdict: &Verdict) -> String {
    let (Some(whole), Some(left)) = (verdict.explained, verdict.unexplained) else {
        return String::new();
    };
    // One effect on several targets explains a part together.
    let is_one =
        |a: &FittedEffect, b: &FittedEffect| (a.effect, a.explained) == (b.effect, b.explained);
    let each = verdict.effects.chunk_by(is_one).filter_map(|of| {
        let share = part_of_excess(of[0].explained?);
        let by = match of {
            [one] => effect_on(one.effect, &one.target),
            all => format!("{} in {} places", effect_name(all[0].effect), all.len()),
        };
        Some(format!("{share} alone by {by}"))
    });
    let each: Vec<String> = each.take(EFFECTS).collect();
    let each = if each.len() > 1 {
        format!(" ({})", joined(each.into_iter()))
    } else {
        String::new()
    };
    format!(
        "{} of the excess over noise{each}, {} left",
        part_of_excess(whole),
        part_of_excess(left)
    )
}

/// Parameters of what was added whose interval leaves zero out; of an effect that has none the one that is surest.
fn values(record: &Record) -> String {
    let added = &record.named.added();
    let all = added
        .iter()
        .map(|effect| effect.parameters.len())
        .sum::<usize>();
    let told = added.iter().flat_map(|effect| {
        let alike = added.iter().filter(|of| of.effect == effect.effect).count();
        told_of(&effect.parameters)
            .enumerate()
            .map(move |(at, parameter)| {
                let own = match parameter.by_trial.is_empty() {
                    true => String::new(),
                    false => format!("; {}", by_trial(parameter)),
                };
                let whose = match (at, alike) {
                    (0, 2..) => format!("{}: ", effect_on(effect.effect, &effect.target)),
                    (0, _) if added.len() > 1 => format!("{}: ", effect_name(effect.effect)),
                    _ => String::new(),
                };
                format!(
                    "{whose}{} {} ({}{own})",
                    parameter.name,
                    with_unit(parameter.value, &parameter.unit),
                    interval(parameter.ci95)
                )
            })
    });
    let told: Vec<String> = told.collect();
    let count = told.len();
    let mut words = joined(told.into_iter().take(PARAMETERS));
    if count > PARAMETERS {
        words += &format!(", and {} more", count - PARAMETERS);
    }
    if count < all {
        words += &format!("; of {} more the interval holds 0", all - count);
    }
    words
}

/// Parameters of an effect whose interval leaves zero out, or the one that is the most of its interval.
fn told_of(all: &[FittedParameter]) -> impl Iterator<Item = &FittedParameter> {
    let sure =
        |of: &FittedParameter| of.value.abs() / (of.ci95[1] - of.ci95[0]).max(f64::MIN_POSITIVE);
    let surest = all.iter().max_by(|a, b| sure(a).total_cmp(&sure(b)));
    let told = all.iter().filter(|of| is_told(of));
    let none = !all.iter().any(is_told);
    told.chain(surest.filter(|_| none))
}

/// True where the interval leaves zero out.
fn is_told(parameter: &FittedParameter) -> bool {
    let [low, high] = parameter.ci95;
    low > 0.0 || high < 0.0
}

/// Errors on held-out trials.
fn error(record: &Record) -> String {
    let gap = &record.verdict.gap;
    let metric = gap.metric.to_uppercase();
    match (gap.before, gap.after, gap.reduction) {
        (Some(before), Some(after), Some(reduction)) if record.is_patched() => format!(
            "{metric} {} before, {} after, reduction {} on {} held-out trials{}",
            number(before),
            number(after),
            percent(reduction),
            gap.n_holdout_trials,
            alone(record)
        ),
        (Some(before), ..) => format!(
            "{metric} {} on {} held-out trials",
            number(before),
            gap.n_holdout_trials
        ),
        _ => String::new(),
    }
}

/// The error with the nominal model refitted and nothing added.
fn alone(record: &Record) -> String {
    let verified = record.verified.as_ref();
    let alone = verified.and_then(|of| of.recalibrated);
    alone.map_or(String::new(), |alone| {
        format!(" ({} with numbers refitted alone)", number(alone))
    })
}

/// Result of `find` alone.
pub(super) fn found(found: &Found) -> String {
    let first = found
        .places
        .first()
        .map_or(String::new(), |largest| format!("; {}", place(largest)));
    one_line(&format!(
        "squared difference {} times that of noise (p {}){first}",
        number(found.excess),
        number(found.p_value)
    ))
}

/// Result of `name` alone.
pub(super) fn named(named: &Named) -> String {
    let effects = named.effects.iter().take(EFFECTS).map(|effect| {
        format!(
            "{} {}",
            effect_on(effect.effect, &effect.target),
            probability(effect.probability)
        )
    });
    let effects = joined(effects);
    one_line(if effects.is_empty() {
        "no effect is likely"
    } else {
        &effects
    })
}

/// Result of `add` alone.
pub(super) fn added(added: Option<&Added>, candidate: &Path) -> String {
    match added {
        Some(added) if added.is_written() => {
            format!("{}, to be verified", candidate.display())
        }
        Some(added) => one_line(&format!("nothing to add: {}", added.remarks.join("; "))),
        None => "nothing to add".to_owned(),
    }
}

fn joined(words: impl Iterator<Item = String>) -> String {
    words.collect::<Vec<_>>().join(", ")
}

/// Text without line breaks and control characters.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}
