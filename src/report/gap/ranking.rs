//! Section of the page: probabilities of effects, and of the sets that were tried.

use std::fmt::Write as _;

use hydro_gap::{
    records::Named,
    verdict::{FittedEffect, Verdict},
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
         <th>probability</th></tr>",
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
            "</td><td class=\"n\">{}</td></tr>",
            escape(&short_probability(effect.probability))
        );
    }
    html.push_str("</table></div>");
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
         Approximate: screened by sensitivities, not refitted by full rollouts.</p>",
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
        // Only what was refitted has a probability; a screen's evidence is about the nominal, not about the best.
        let (note, probability, left) = if set.refitted || set.effects.is_empty() {
            (
                "",
                short_probability(set.probability),
                percent(set.unexplained),
            )
        } else {
            let dash = "\u{2013}".to_owned();
            (
                " <span class=\"note\">approximate</span>",
                dash.clone(),
                dash,
            )
        };
        let _ = write!(
            html,
            "<tr><td class=\"t\">{words}{note}</td><td class=\"bar\">"
        );
        svg::share_bar(html, "fp", set.probability);
        let _ = write!(
            html,
            "</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(&probability),
            number(set.log_evidence),
            left
        );
    }
    html.push_str("</table></div>");
}
