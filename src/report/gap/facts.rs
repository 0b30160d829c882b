//! Key figures on top, remarks and provenance at the end.

use std::fmt::Write as _;

use hydro_gap::{Options, records::Record};

use super::{
    numbers::{bare_percent, number, p_value, part_of_excess, percent},
    sentence,
};
use crate::report::html::escape;

/// The figures below the verdict.
pub(super) fn key_figures(html: &mut String, record: &Record) {
    let gap = &record.verdict.gap;
    let mut facts: Vec<(String, String)> = Vec::new();
    let metric = gap.metric.to_uppercase();
    match (gap.before, gap.after) {
        (Some(before), Some(after)) if record.is_patched() => {
            facts.push((
                format!("{} \u{2192} {}", number(before), number(after)),
                format!("{metric} on held-out trials, before \u{2192} after"),
            ));
            let spread = gap.ci95.map_or(String::new(), |[low, high]| {
                format!(", 95 %: {} to {} %", bare_percent(low), bare_percent(high))
            });
            if let Some(reduction) = gap.reduction {
                let kept = if record.verdict.patch.is_some() {
                    "reduction"
                } else {
                    "reduction, not kept"
                };
                facts.push((percent(reduction), format!("{kept}{spread}")));
            }
        }
        (Some(before), _) => facts.push((
            number(before),
            format!("{metric} of the nominal model on held-out trials"),
        )),
        _ => {}
    }
    let cross_fitted = record.verified.as_ref().is_some_and(|v| v.cross_fitted);
    let fitted = record.found.fit_trials.len();
    facts.push(if cross_fitted {
        (
            gap.n_holdout_trials.to_string(),
            "trials, each held out once".to_owned(),
        )
    } else {
        (
            format!("{fitted} + {}", record.found.held_out_trials.len()),
            "trials used + held out".to_owned(),
        )
    });
    facts.push((
        number(record.found.excess),
        format!(
            "squared difference over noise (1 is noise alone), p {}",
            p_value(record.found.p_value)
        ),
    ));
    html.push_str("<ul class=\"facts\">");
    for (figure, words) in facts {
        let _ = write!(
            html,
            "<li><b>{}</b><span>{}</span></li>",
            escape(&figure),
            escape(&words)
        );
    }
    html.push_str("</ul>");
}

/// Conditions under which the excess is large.
pub(super) fn regimes(html: &mut String, record: &Record) {
    if record.verdict.regime.is_empty() {
        return;
    }
    html.push_str(
        "<h3>When</h3><div class=\"wide\"><table><tr><th class=\"t\">condition</th><th></th>\
         <th>of the excess</th><th>of the samples</th></tr>",
    );
    for regime in &record.verdict.regime {
        let _ = write!(
            html,
            "<tr><td class=\"t\"><code>{}</code></td><td class=\"bar\">",
            escape(&regime.rule)
        );
        super::svg::share_bar(html, "fb", regime.share);
        let _ = write!(
            html,
            "</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            percent(regime.share),
            percent(regime.samples)
        );
    }
    html.push_str("</table></div>");
}

/// The largest windows that noise alone does not explain.
pub(super) fn places(html: &mut String, record: &Record) {
    const MOST: usize = 6;
    if record.verdict.places.is_empty() {
        let p = record.found.p_value;
        if p <= Options::default().locate.level {
            let _ = write!(
                html,
                "<p>No single window stands out from what chance gives; what is small everywhere adds up to more \
                 than chance (p {}).</p>",
                escape(&p_value(p))
            );
        } else {
            html.push_str("<p>No window stands out from what chance gives.</p>");
        }
        return;
    }
    html.push_str("<ul>");
    for place in record.verdict.places.iter().take(MOST) {
        let _ = write!(
            html,
            "<li>{} <span class=\"note\">(p {})</span></li>",
            marked(&sentence::place(place)),
            escape(&p_value(place.p_value))
        );
    }
    html.push_str("</ul>");
    if let more @ 1.. = record.verdict.places.len().saturating_sub(MOST) {
        let _ = write!(
            html,
            "<p class=\"note\">{more} more windows are framed below.</p>"
        );
    }
}

/// Explanations that the data cannot separate, and the experiment that would.
pub(super) fn undecided(html: &mut String, record: &Record) {
    let verdict = &record.verdict;
    let before = html.len();
    if !verdict.confusion_set.is_empty() {
        let members: Vec<String> = verdict
            .effects
            .iter()
            .filter(|effect| verdict.confusion_set.contains(&effect.effect))
            .map(|effect| sentence::effect_on(effect.effect, &effect.target))
            .collect();
        let members = if members.is_empty() {
            let ids = verdict.confusion_set.iter();
            ids.map(|id| sentence::effect_name(*id).to_owned())
                .collect()
        } else {
            members
        };
        html.push_str("<p>On these trials the following make the same difference:</p><ul>");
        for member in members {
            let _ = write!(html, "<li>{}</li>", marked(&member));
        }
        html.push_str("</ul>");
    }
    if let Some(why) = &verdict.refused_because {
        let _ = write!(html, "<p><b>Not verified:</b> {}</p>", marked(why));
    }
    if let Some(experiment) = &verdict.next_experiment {
        let _ = write!(
            html,
            "<p><b>Next experiment:</b> {}</p>",
            marked(experiment)
        );
    }
    if let Some(unexplained) = verdict.unexplained {
        let explained = verdict.explained.unwrap_or(0.0);
        let _ = write!(
            html,
            "<p>Explained: {} of the excess over noise; left: {}.</p>",
            part_of_excess(explained),
            part_of_excess(unexplained)
        );
    }
    if html.len() == before {
        html.push_str("<p>Nothing is undecided.</p>");
    }
}

/// Remarks of every stage, without repetition.
pub(super) fn remarks(html: &mut String, record: &Record) {
    let added = record.added.iter().flat_map(|stage| &stage.remarks);
    let verified = record.verified.iter().flat_map(|stage| &stage.remarks);
    let mut all: Vec<&String> = Vec::new();
    for remark in record
        .found
        .remarks
        .iter()
        .chain(&record.named.remarks)
        .chain(added)
        .chain(verified)
    {
        if !all.contains(&remark) {
            all.push(remark);
        }
    }
    if all.is_empty() {
        return;
    }
    html.push_str("<h2>Remarks</h2><ul>");
    for remark in all {
        let _ = write!(html, "<li>{}</li>", marked(remark));
    }
    html.push_str("</ul>");
}

/// Sensors compared and their noise.
pub(super) fn channels(html: &mut String, record: &Record) {
    if record.found.channels.is_empty() {
        return;
    }
    let _ = write!(
        html,
        "<details><summary>{} channels compared, with their noise</summary><div class=\"wide\"><table>\
         <tr><th class=\"t\">channel</th><th>noise used</th><th>noise in the MJCF</th><th class=\"t\">unit</th></tr>",
        record.found.channels.len()
    );
    for channel in &record.found.channels {
        let _ = write!(
            html,
            "<tr><td class=\"t\">{}[{}]</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"t\">{}</td></tr>",
            escape(&channel.sensor),
            channel.component,
            number(channel.noise),
            channel
                .declared_noise
                .map_or("none, estimated".to_owned(), number),
            escape(&channel.unit)
        );
    }
    html.push_str("</table></div></details>");
}

/// Model, command and times.
pub(super) fn provenance(html: &mut String, record: &Record) {
    let _ = write!(
        html,
        "<h2>Where this comes from</h2><p>Nominal model <code>{}</code></p><pre>{}</pre>",
        escape(&record.model),
        escape(&record.command)
    );
    for (words, trials) in [
        ("Trials used", &record.found.fit_trials),
        ("Trials held out", &record.found.held_out_trials),
    ] {
        if !trials.is_empty() {
            let _ = write!(
                html,
                "<p class=\"note\">{words}: {}</p>",
                escape(&trials.join(", "))
            );
        }
    }
    if record.seconds.is_empty() {
        return;
    }
    // In the order in which they ran; a stage that this page does not know comes last.
    let order = |name: &str| {
        let stages = ["prepare", "sensitivities", "find", "name", "add", "verify"];
        let known = stages.iter().position(|stage| *stage == name);
        known.unwrap_or(stages.len())
    };
    let mut seconds: Vec<(&String, &f64)> = record.seconds.iter().collect();
    seconds.sort_by_key(|(name, _)| order(name));
    let times: Vec<String> = seconds
        .iter()
        .map(|(name, value)| format!("{name} {} s", number(**value)))
        .collect();
    let _ = write!(
        html,
        "<p class=\"note\">Time: {}</p>",
        escape(&times.join(", "))
    );
}

/// Text with names between backticks, as HTML; a number stays on the line of its percent sign.
pub(super) fn marked(text: &str) -> String {
    let mut html = String::new();
    let text = text.replace(" %", "\u{a0}%");
    for (index, part) in text.split('`').enumerate() {
        if index % 2 == 1 {
            let _ = write!(html, "<code>{}</code>", escape(part));
        } else {
            html.push_str(&escape(part));
        }
    }
    html
}
