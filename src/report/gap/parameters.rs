//! Section of the page: fitted parameters with interval and unit, drawn against zero, and fitted nuisance parameters.

use std::fmt::Write as _;

use hydro_gap::{
    Options,
    records::Record,
    verdict::{FittedEffect, FittedParameter},
};

use super::{
    numbers::{by_trial, interval, number, with_unit},
    sentence::effect_name,
    svg::{self, Scale},
};
use crate::report::html::escape;

/// Size of a drawn interval [px].
const SIZE: (f64, f64) = (200.0, 22.0);
/// Greatest number of likely effects shown beside the chosen ones.
const LIKELY: usize = 6;

/// The section.
pub(super) fn section(html: &mut String, record: &Record) {
    let written = record
        .added
        .as_ref()
        .map(|added| added.effects.as_slice())
        .filter(|effects| !effects.is_empty());
    let added = record.named.added();
    let (chosen, others) = match written {
        Some(effects) => (effects, Vec::new()),
        None if !added.is_empty() => (added.as_slice(), Vec::new()),
        None => (
            &[][..],
            record
                .verdict
                .effects
                .iter()
                .take(LIKELY)
                .collect::<Vec<_>>(),
        ),
    };
    let effects: Vec<&FittedEffect> = chosen.iter().chain(others).collect();
    if effects.iter().all(|effect| effect.parameters.is_empty()) {
        html.push_str("<p>No parameter was fitted.</p>");
    } else {
        table(html, record, &effects);
    }
    nuisances(html, &record.named.nuisances);
}

fn table(html: &mut String, record: &Record, effects: &[&FittedEffect]) {
    html.push_str(
        "<div class=\"wide\"><table><tr><th class=\"t\">parameter</th><th>value</th><th>95 % interval</th>\
         <th></th></tr>",
    );
    let mut has_bootstrap = false;
    for effect in effects {
        let bootstrap = bootstrap(record, effect);
        let _ = write!(
            html,
            "<tr><td class=\"t\" colspan=\"4\"><b>{}</b> on <code>{}</code></td></tr>",
            effect_name(effect.effect),
            escape(&effect.target)
        );
        for parameter in &effect.parameters {
            let again = bootstrap.iter().find(|other| other.name == parameter.name);
            has_bootstrap |= again.is_some();
            row(html, parameter, again);
        }
    }
    html.push_str("</table></div>");
    let _ = write!(
        html,
        "<p class=\"note\">Drawn from zero (dashed): dot and line, the value and its 95 % interval{}. Where the \
         equation idealises (drag, added mass, friction; not a mass, a gain or a bias) it holds, beside the fit's, a \
         standard deviation of {} % of the value for what nature's form differs by; the bootstrap's does not.</p>",
        if has_bootstrap {
            "; grey and in brackets, the interval of a bootstrap over trials"
        } else {
            ""
        },
        100.0 * Options::default().likelihood.form_error
    );
}

fn bootstrap<'a>(record: &'a Record, effect: &FittedEffect) -> &'a [FittedParameter] {
    record
        .added
        .iter()
        .flat_map(|added| &added.bootstrap)
        .find(|(id, target, _)| *id == effect.effect && *target == effect.target)
        .map_or(&[], |(_, _, parameters)| parameters)
}

fn row(html: &mut String, parameter: &FittedParameter, again: Option<&FittedParameter>) {
    let brackets = again.map_or(String::new(), |other| {
        format!(
            "<br/><span class=\"note\">[{}]</span>",
            escape(&interval(other.ci95))
        )
    });
    let own = match parameter.by_trial.is_empty() {
        true => String::new(),
        false => format!(
            "<br/><span class=\"note\">mean; {}</span>",
            escape(&by_trial(parameter))
        ),
    };
    let _ = write!(
        html,
        "<tr><td class=\"t\"><code>{}</code>{own}</td><td class=\"n\">{}</td><td class=\"n\">{}{brackets}</td>\
         <td class=\"dots\">",
        escape(&parameter.name),
        escape(&with_unit(parameter.value, &parameter.unit)),
        escape(&interval(parameter.ci95))
    );
    drawn(html, parameter, again);
    html.push_str("</td></tr>");
}

/// Interval of a parameter on a scale of its own, for units differ. Zero is on every scale, so that the width shows the
/// precision.
fn drawn(html: &mut String, parameter: &FittedParameter, again: Option<&FittedParameter>) {
    let (width, height) = SIZE;
    let values = [0.0, parameter.value]
        .into_iter()
        .chain(parameter.ci95)
        .chain(again.into_iter().flat_map(|other| other.ci95));
    let scale = Scale::new(svg::range(values), (8.0, width - 8.0));
    let words = format!(
        "{} {}, {}",
        parameter.name,
        number(parameter.value),
        interval(parameter.ci95)
    );
    svg::open(html, width, height, &words);
    let zero = scale.at(0.0);
    svg::line(html, "zero", (zero, 1.0), (zero, height - 1.0));
    let mut bar = |class: &str, [low, high]: [f64; 2], y: f64| {
        if low.is_finite() && high.is_finite() {
            let (from, to) = (scale.at(low), scale.at(high));
            svg::line(html, class, (from, y), (to, y));
            svg::line(html, class, (from, y - 3.0), (from, y + 3.0));
            svg::line(html, class, (to, y - 3.0), (to, y + 3.0));
        }
    };
    let y = if again.is_some() { 7.0 } else { 11.0 };
    bar("ci", parameter.ci95, y);
    if let Some(other) = again {
        bar("boot", other.ci95, 16.0);
    }
    if parameter.value.is_finite() {
        let _ = write!(
            html,
            "<circle class=\"dot\" cx=\"{}\" cy=\"{}\" r=\"4\"/>",
            svg::coordinate(scale.at(parameter.value)),
            svg::coordinate(y)
        );
    }
    html.push_str("</svg>");
}

fn nuisances(html: &mut String, nuisances: &[(String, f64, f64)]) {
    if nuisances.is_empty() {
        return;
    }
    html.push_str(
        "<h3>Uncertain numbers of the nominal model</h3><p class=\"note\">Fitted beside every explanation, \
         within what the nominal may be off: no missing effect.</p><details><summary>",
    );
    let _ = write!(
        html,
        "{} numbers</summary><div class=\"wide\"><table><tr><th class=\"t\">number</th><th>value</th>\
         <th>standard deviation</th></tr>",
        nuisances.len()
    );
    for (name, value, deviation) in nuisances {
        let _ = write!(
            html,
            "<tr><td class=\"t\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(name),
            number(*value),
            number(*deviation)
        );
    }
    html.push_str("</table></div></details>");
}
