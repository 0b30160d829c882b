//! Section of the page: measurement and predictions on held-out trials, one small plot for each channel.

use std::fmt::Write as _;

use hydro_gap::records::Overlay;

use super::{
    numbers::number,
    svg::{self, Anchor, Scale},
};
use crate::report::html::escape;

/// Size of a plot [px].
const SIZE: (f64, f64) = (360.0, 170.0);
/// Space left of and below the lines [px].
const MARGIN: (f64, f64) = (46.0, 22.0);
/// Greatest size of the plots of a page [byte]; the others are in `verify.json` only.
const BUDGET: usize = 1_800_000;
/// Plots that are shown at once, in whole trials; the others unfold.
const OPEN_PLOTS: usize = 18;

/// The section.
pub(super) fn section(html: &mut String, overlays: &[Overlay], patched: bool) {
    html.push_str("<p class=\"legend\">");
    let lines: &[(&str, &str)] = if patched {
        &[
            ("m", "measured"),
            ("b", "before: nominal model"),
            ("a", "after: patched model"),
        ]
    } else {
        &[("m", "measured"), ("b", "nominal model")]
    };
    for (class, words) in lines {
        let _ = write!(
            html,
            "<span><svg viewBox=\"0 0 34 10\" aria-hidden=\"true\"><path class=\"{class}\" d=\"M0 5h34\"/></svg>{words}</span>"
        );
    }
    html.push_str("</p>");
    let mut trials: Vec<&str> = Vec::new();
    for overlay in overlays {
        if !trials.contains(&overlay.trial.as_str()) {
            trials.push(&overlay.trial);
        }
    }
    let start = html.len();
    let (mut plots, mut left_out) = (0, 0);
    for (index, trial) in trials.iter().enumerate() {
        plots += overlays.iter().filter(|o| o.trial == *trial).count();
        let folded = index > 0 && plots > OPEN_PLOTS;
        let (open, close) = if folded {
            ("<details><summary>", "</summary>")
        } else {
            ("<h3>", "</h3>")
        };
        let _ = write!(html, "{open}{}{close}<div class=\"grid\">", escape(trial));
        for overlay in overlays.iter().filter(|overlay| overlay.trial == *trial) {
            if html.len() - start > BUDGET {
                left_out += 1;
                continue;
            }
            plot(html, overlay, &title(overlay, overlays), patched);
        }
        html.push_str(if folded { "</div></details>" } else { "</div>" });
    }
    if left_out > 0 {
        let _ = write!(
            html,
            "<p class=\"note\">{left_out} more plots would make the page heavy; their numbers are in \
             <code>verify.json</code>.</p>"
        );
    }
}

fn plot(html: &mut String, overlay: &Overlay, title: &str, patched: bool) {
    let (width, height) = SIZE;
    let (left, bottom) = (MARGIN.0, height - MARGIN.1);
    let unit = match overlay.unit.as_str() {
        "" | "1" => String::new(),
        unit => format!(" [{unit}]"),
    };
    let _ = write!(
        html,
        "<figure><figcaption>{}{}</figcaption>",
        escape(title),
        escape(&unit)
    );
    svg::open(
        html,
        width,
        height,
        &format!("{title} in {}: measured, before, after", overlay.trial),
    );
    let lines = [
        ("m", &overlay.measured),
        ("b", &overlay.before),
        ("a", &overlay.after),
    ];
    let lines = &lines[..if patched { 3 } else { 2 }];
    let values = lines.iter().flat_map(|(_, line)| line.iter().flatten());
    let (low, high) = svg::range(values.copied());
    let pad = (high - low) * 0.06;
    let y = Scale::new((low - pad, high + pad), (bottom, 6.0));
    let x = Scale::new(
        svg::range(overlay.time.iter().copied()),
        (left, width - 14.0),
    );
    for tick in y.ticks(4) {
        let at = y.at(tick);
        svg::line(html, "axis", (left, at), (width - 14.0, at));
        svg::text(html, (left - 5.0, at + 4.0), Anchor::End, "", &number(tick));
    }
    svg::time_axis(html, &x, left, width - 14.0, bottom);
    for (class, line) in lines {
        let path = path(&overlay.time, line, &x, &y);
        if !path.is_empty() {
            let _ = write!(html, "<path class=\"{class}\" d=\"{path}\"/>");
        }
    }
    html.push_str("</svg></figure>");
}

/// The sensor's name, with the component's number where there are several.
fn title(overlay: &Overlay, all: &[Overlay]) -> String {
    let several = all
        .iter()
        .any(|other| other.sensor == overlay.sensor && other.component > 0);
    if several {
        format!("{}[{}]", overlay.sensor, overlay.component)
    } else {
        overlay.sensor.clone()
    }
}

/// The line as a path that breaks where there is no value. Of the points inside one pixel column only the first, the least,
/// the greatest and the last are kept, the visible ones.
fn path(time: &[f64], values: &[Option<f64>], x: &Scale, y: &Scale) -> String {
    let mut path = String::new();
    let mut run: Vec<(f64, f64)> = Vec::new();
    for (t, value) in time.iter().zip(values) {
        match value.filter(|value| value.is_finite() && t.is_finite()) {
            Some(value) => run.push((x.at(*t), y.at(value))),
            None => stroke(&mut path, &mut run),
        }
    }
    stroke(&mut path, &mut run);
    path
}

/// Writes a run without gaps and empties it. A lone point becomes a dot.
fn stroke(path: &mut String, run: &mut Vec<(f64, f64)>) {
    let points = thinned(run);
    run.clear();
    let Some(&(x0, y0)) = points.first() else {
        return;
    };
    // Steps between rounded places, so that rounding does not add up.
    let round = |(x, y): (f64, f64)| ((x * 10.0).round() as i64, (y * 10.0).round() as i64);
    let tenths = |value: i64| svg::coordinate(value as f64 / 10.0);
    let mut last = round((x0, y0));
    let _ = write!(path, "M{} {}", tenths(last.0), tenths(last.1));
    if points.len() == 1 {
        path.push_str("h1");
        return;
    }
    path.push('l');
    for (index, point) in points[1..].iter().enumerate() {
        let next = round(*point);
        let (dx, dy) = (tenths(next.0 - last.0), tenths(next.1 - last.1));
        if index > 0 && !dx.starts_with('-') {
            path.push(' ');
        }
        path.push_str(&dx);
        if !dy.starts_with('-') {
            path.push(' ');
        }
        path.push_str(&dy);
        last = next;
    }
}

fn thinned(run: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept = Vec::with_capacity(run.len());
    for column in run.chunk_by(|a, b| (a.0.floor() - b.0.floor()).abs() < 0.5) {
        let last = column.len() - 1;
        let by = |better: fn(f64, f64) -> bool| {
            (1..column.len()).fold(0, |best, i| {
                if better(column[i].1, column[best].1) {
                    i
                } else {
                    best
                }
            })
        };
        let mut indices = [0, by(|a, b| a < b), by(|a, b| a > b), last];
        indices.sort_unstable();
        let mut previous = None;
        for index in indices {
            if previous != Some(index) {
                kept.push(column[index]);
            }
            previous = Some(index);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_breaks_where_there_is_no_value_and_keeps_its_peaks() {
        let scale = |high| Scale::new((0.0, high), (0.0, 100.0));
        let time: Vec<f64> = (0..5).map(f64::from).collect();
        let values = [Some(0.0), Some(1.0), None, Some(f64::NAN), Some(2.0)];
        assert_eq!(
            path(&time, &values, &scale(10.0), &scale(10.0)),
            "M0 0l10 10M40 20h1"
        );
        // A thousand points in ten pixels, one of them a peak.
        let run: Vec<(f64, f64)> = (0..1000)
            .map(|i| (f64::from(i) / 100.0, if i == 555 { 7.0 } else { 0.0 }))
            .collect();
        let kept = thinned(&run);
        assert!(kept.len() <= 40 && kept.contains(&(5.55, 7.0)), "{kept:?}");
    }
}
