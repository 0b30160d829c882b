//! Section of the page: the error before and after, by horizon and by sensor.

use std::fmt::Write as _;

use hydro_gap::records::Verified;

use super::{
    numbers::{bare_percent, number, percent},
    svg,
};
use crate::report::html::escape;

/// One line of a table of errors.
struct Row {
    name: String,
    before: f64,
    after: f64,
    reduction: f64,
    ci95: [f64; 2],
}

/// Errors by horizon.
pub(super) fn horizons(html: &mut String, verified: &Verified, patched: bool) {
    let rows = verified.horizons.iter().map(|horizon| Row {
        name: format!("{} s", number(horizon.seconds)),
        before: horizon.before,
        after: horizon.after,
        reduction: 1.0 - horizon.after / horizon.before,
        ci95: horizon.ci95,
    });
    table(html, "horizon", rows.collect(), patched);
}

/// Errors by sensor.
pub(super) fn sensors(html: &mut String, verified: &Verified, patched: bool) {
    let rows = verified.gap.per_sensor.iter().map(|(name, gap)| Row {
        name: name.clone(),
        before: gap.before,
        after: gap.after,
        reduction: gap.reduction,
        ci95: gap.ci95,
    });
    let mut rows: Vec<Row> = rows.collect();
    rows.sort_by(|a, b| b.before.total_cmp(&a.before));
    table(html, "sensor", rows, patched);
}

fn table(html: &mut String, head: &str, rows: Vec<Row>, patched: bool) {
    if rows.is_empty() {
        return;
    }
    let (_, greatest) = svg::range(rows.iter().flat_map(|row| [row.before, row.after]));
    let columns = if patched {
        "<th>before</th><th>after</th><th>reduction (95 %)</th>"
    } else {
        "<th>NRMSE</th>"
    };
    let _ = write!(
        html,
        "<div class=\"wide\"><table><tr><th class=\"t\">{head}</th><th></th>{columns}</tr>"
    );
    for row in rows {
        let _ = write!(
            html,
            "<tr><td class=\"t\">{}</td><td class=\"bar\">",
            escape(&row.name)
        );
        let after = patched.then_some(row.after / greatest);
        bars(html, row.before / greatest, after);
        let _ = write!(html, "</td><td class=\"n\">{}</td>", number(row.before));
        if patched {
            let [low, high] = row.ci95;
            let _ = write!(
                html,
                "<td class=\"n\">{}</td><td class=\"n\">{} ({} to {} %)</td>",
                number(row.after),
                percent(row.reduction),
                bare_percent(low),
                bare_percent(high)
            );
        }
        html.push_str("</tr>");
    }
    html.push_str("</table></div>");
}

/// Bars, before above after, relative to the greatest error of the table.
fn bars(html: &mut String, before: f64, after: Option<f64>) {
    html.push_str("<svg viewBox=\"0 0 100 18\" preserveAspectRatio=\"none\" aria-hidden=\"true\">");
    // One alone stands in the middle.
    let first = if after.is_some() { 1 } else { 5 };
    for (class, y, part) in [("fb", first, Some(before)), ("fa", 10, after)] {
        let Some(part) = part.filter(|part| part.is_finite()) else {
            continue;
        };
        let _ = write!(
            html,
            "<rect class=\"{class}\" y=\"{y}\" width=\"{}\" height=\"7\"/>",
            svg::coordinate(100.0 * part.clamp(0.0, 1.0))
        );
    }
    html.push_str("</svg>");
}

/// Legend of the two bars.
pub(super) fn legend(html: &mut String, patched: bool) {
    if !patched {
        return;
    }
    html.push_str("<p class=\"legend\">");
    for (class, words) in [
        ("fb", "before: nominal model"),
        ("fa", "after: patched model"),
    ] {
        let _ = write!(
            html,
            "<span><svg viewBox=\"0 0 34 10\" aria-hidden=\"true\"><rect class=\"{class}\" y=\"1.5\" width=\"34\" \
             height=\"7\"/></svg>{words}</span>"
        );
    }
    html.push_str("</p>");
}
