//! Section of the page: probabilities of effects, and of the sets that were tried.

use std::{collections::BTreeSet, fmt::Write as _};

use hydro_gap::{
    records::Named,
    verdict::{Calibration, FittedEffect, Verdict},
};

use super::{
    numbers::{number, percent, short_probability},
    sentence::effect_name,
    svg,
};
use crate::report::html::escape;

/// Sets that are shown at once; the others unfold.
const OPEN_SETS: usize = 8;

/// Probabilities of the effects.
pub(super) fn effects(html: &mut String, verdict: &Verdict, chosen: &[FittedEffect]) {
    if verdict.effects.is_empty() {
        html.push_str("<p>No effect of the catalogue has a probability worth showing.</p>");
        return;
    }
    html.push_str(
        "<div class=\"wide\"><table><tr><th class=\"t\">effect</th><th class=\"t\">on</th><th></th>\
         <th>probability</th><th>explains</th></tr>",
    );
    for effect in &verdict.effects {
        let is_chosen = chosen
            .iter()
            .any(|other| other.effect == effect.effect && other.target == effect.target);
        let mut tags = String::new();
        if is_chosen {
            let word = if verdict.patch.is_some() {
                "added"
            } else {
                "likeliest"
            };
            let _ = write!(tags, "<span class=\"tag added\">{word}</span>");
        }
        if effect.surrogate {
            tags.push_str("<span class=\"tag standin\">stand-in</span>");
        }
        if !is_chosen && verdict.confusion_set.contains(&effect.effect) {
            tags.push_str("<span class=\"tag either\">cannot tell</span>");
        }
        let class = if is_chosen { " class=\"chosen\"" } else { "" };
        let _ = write!(
            html,
            "<tr{class}><td class=\"t\">{}{tags}</td><td class=\"t\">{}</td><td class=\"bar\">",
            effect_name(effect.effect),
            escape(&effect.target)
        );
        svg::share_bar(html, "fp", effect.probability);
        let _ = write!(
            html,
            "</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(&short_probability(effect.probability)),
            effect.explained.map_or("\u{2013}".to_owned(), percent)
        );
    }
    html.push_str(
        "</table></div><p class=\"note\">Explains: part of the excess over noise that comes back where this effect alone \
         is left out.</p>",
    );
    if verdict.effects.iter().any(|effect| effect.surrogate) {
        html.push_str(
            "<p class=\"note\">A stand-in fits best, but only because what is really missing is not in the \
             catalogue.</p>",
        );
    }
}

/// Sets of effects that were tried.
pub(super) fn sets(html: &mut String, named: &Named) {
    if named.ranking.is_empty() {
        return;
    }
    html.push_str("<h3>Sets that were tried</h3>");
    let (first, others) = named.ranking.split_at(named.ranking.len().min(OPEN_SETS));
    table(html, first);
    if !others.is_empty() {
        let _ = write!(html, "<details><summary>{} more</summary>", others.len());
        table(html, others);
        html.push_str("</details>");
    }
    html.push_str(
        "<p class=\"note\">Evidence: log evidence less that of nothing missing; a set that is 3 nat ahead is \
         about 20 times likelier before the prior. Left: part of the excess that the set leaves unexplained. \
         First order: the readings were linearised about another set.</p>",
    );
    confusions(html, &named.calibration);
}

/// Table of confusions: sets found in trials simulated from the leading ones.
fn confusions(html: &mut String, calibration: &Calibration) {
    if calibration.confusion.is_empty() {
        return;
    }
    let truths: BTreeSet<&String> = (calibration.confusion.values())
        .flat_map(|row| row.keys())
        .collect();
    html.push_str(
        "<h3>Would this method tell them apart?</h3><div class=\"wide\"><table><tr><th class=\"t\">said</th>",
    );
    for truth in &truths {
        let _ = write!(html, "<th>where {} is true</th>", escape(truth));
    }
    html.push_str("</tr>");
    for (said, row) in &calibration.confusion {
        let _ = write!(html, "<tr><td class=\"t\">{}</td>", escape(said));
        for truth in &truths {
            let part = row.get(*truth).copied().unwrap_or(0.0);
            let _ = write!(html, "<td class=\"n\">{}</td>", percent(part));
        }
        html.push_str("</tr>");
    }
    let _ = write!(
        html,
        "</table></div><p class=\"note\">Trials simulated from each leading set, to first order, and searched again. Of \
         trials in which nothing is missing, {} look as much like a gap as these.</p>",
        percent(calibration.alarm)
    );
}

fn table(html: &mut String, sets: &[hydro_gap::records::Hypothesis]) {
    html.push_str(
        "<div class=\"wide\"><table><tr><th class=\"t\">set</th><th></th><th>probability</th>\
         <th>evidence [nat]</th><th>left</th></tr>",
    );
    for set in sets {
        let words: Vec<String> = set
            .effects
            .iter()
            .map(|(id, target)| format!("{} on <code>{}</code>", effect_name(*id), escape(target)))
            .collect();
        let words = if words.is_empty() {
            "nothing is missing".to_owned()
        } else {
            words.join(" + ")
        };
        let note = if set.refitted {
            ""
        } else {
            " <span class=\"note\">first order</span>"
        };
        let _ = write!(
            html,
            "<tr><td class=\"t\">{words}{note}</td><td class=\"bar\">"
        );
        svg::share_bar(html, "fp", set.probability);
        let _ = write!(
            html,
            "</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(&short_probability(set.probability)),
            number(set.log_evidence),
            percent(set.unexplained)
        );
    }
    html.push_str("</table></div>");
}
