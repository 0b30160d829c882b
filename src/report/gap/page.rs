//! The page: the order of its sections, and those that an outcome leaves out.

use std::fmt::Write as _;

use hydro_gap::records::{Record, Verified};

use super::{
    diff, errors, facts, heat_map, overlay, parameters, ranking,
    sentence::{self, VerdictKind},
};
use crate::report::html::escape;

const STYLE: &str = include_str!("style.css");

/// Renders `report.html`; the policy in its head forbids scripts and outside references.
pub fn page(record: &Record) -> String {
    let kind = VerdictKind::from_verdict(&record.verdict);
    let mut html = String::with_capacity(256 * 1024);
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\
         <title>hydro gap: {}</title><style>{STYLE}</style></head><body>",
        escape(&record.model)
    );
    let _ = write!(
        html,
        "<header class=\"{}\"><p class=\"label\">{}</p><h1>{}</h1>",
        class(kind),
        kind.label(),
        facts::marked(&sentence::headline(&record.verdict, &record.named.chosen))
    );
    if let Some(experiment) = record
        .verdict
        .next_experiment
        .as_deref()
        .filter(|_| kind == VerdictKind::Confusable)
    {
        let _ = write!(
            html,
            "<p>Next experiment: {}</p>",
            facts::marked(experiment)
        );
    }
    let alone = sentence::recalibration(record);
    if !alone.is_empty() {
        let _ = write!(html, "<p>{alone}</p>");
    }
    html.push_str("</header>");
    facts::key_figures(&mut html, record);

    html.push_str("<h2>Where simulation and measurement differ</h2>");
    facts::places(&mut html, record);
    heat_map::section(&mut html, &record.found, &record.verdict.places);
    facts::regimes(&mut html, record);
    heat_map::shares(&mut html, &record.found, &record.verdict.places);
    facts::channels(&mut html, record);

    html.push_str("<h2>Which effect is missing</h2>");
    ranking::effects(&mut html, &record.verdict, &record.named.chosen);
    ranking::sets(&mut html, &record.named);

    html.push_str("<h2>Its parameters</h2>");
    parameters::section(&mut html, record);

    if let Some(verified) = &record.verified {
        held_out(&mut html, verified, record.is_patched());
    }

    html.push_str("<h2>What it could not tell</h2>");
    facts::undecided(&mut html, record);

    html.push_str("<h2>What was written into the model</h2>");
    diff::section(
        &mut html,
        record.added.as_ref(),
        record.verdict.patch.as_ref(),
    );

    facts::remarks(&mut html, record);
    facts::provenance(&mut html, record);
    html.push_str("</body></html>\n");
    html
}

/// Results on the held-out trials; `patched`: there are errors after the patch.
fn held_out(html: &mut String, verified: &Verified, patched: bool) {
    html.push_str(if patched {
        "<h2>Error on held-out trials, before and after</h2>"
    } else {
        "<h2>Error of the nominal model on held-out trials</h2>"
    });
    if verified.cross_fitted {
        html.push_str(
            "<p class=\"note\">Few trials: each was held out once, and predicted by a fit to the others.</p>",
        );
    }
    errors::legend(html, patched);
    html.push_str("<h3>By length of the prediction</h3>");
    errors::horizons(html, verified, patched);
    html.push_str("<h3>By sensor</h3>");
    errors::sensors(html, verified, patched);
    html.push_str(
        "<p class=\"note\">NRMSE: root mean square error over standard deviation of the measurement, noise \
         taken out; open-loop predictions from measured starts.</p>",
    );
    if !verified.overlays.is_empty() {
        html.push_str("<h2>Measured and predicted, held-out trials</h2>");
        overlay::section(html, &verified.overlays, patched);
    }
}

fn class(kind: VerdictKind) -> &'static str {
    match kind {
        VerdictKind::Verified => "verified",
        VerdictKind::Unchecked => "unchecked",
        VerdictKind::Refused => "refused",
        VerdictKind::Confusable => "confusable",
        VerdictKind::NoGap => "no_gap",
        VerdictKind::Unknown | VerdictKind::Contradicted => "unknown",
    }
}
