//! The page of a comparison: one HTML file without outside references.

use std::fmt::Write as _;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use hydro_training::comparison::{BOUND, ClosedLoop, LongRun, LongRunPeaks, OpenLoop, Summary};

use super::{
    html::escape,
    plot::{self, Axes, Series},
};

const STYLE: &str = "
body{font:15px/1.5 system-ui,sans-serif;color:#1a1a1a;max-width:1080px;margin:2em auto;padding:0 1em}
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid #ddd}
p.lead{font-size:1.1em}table{border-collapse:collapse;margin:1em 0}
td,th{padding:.3em .8em;text-align:right;border-bottom:1px solid #e4e4e4}
td:first-child,th:first-child{text-align:left}tr.subject{background:#eef6ff;font-weight:600}
.grid{display:grid;grid-template-columns:repeat(auto-fit,minmax(330px,1fr));gap:8px}
svg{max-width:100%;height:auto}.legend span{margin-right:1.2em;white-space:nowrap}
.legend i{display:inline-block;width:1.6em;height:3px;vertical-align:middle;margin-right:.4em}
.note{color:#555;font-size:.92em}video{max-width:100%;border-radius:6px}code{background:#f4f4f4;padding:.1em .3em}";

/// Greatest distance from the truth at which a path is drawn [m]; a farther one would hide the others.
const SHOWN_DISTANCE: f64 = 1.0;

/// A video to embed: its bytes and MIME type.
#[derive(Clone, Debug)]
pub struct Video {
    /// MIME type, `video/mp4` or `video/webm`.
    pub mime: &'static str,
    /// The file.
    pub bytes: Vec<u8>,
}

/// Renders the page.
pub fn render(summary: &Summary, video: Option<&Video>) -> String {
    let mut html = String::new();
    html.push_str("<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">");
    let _ = write!(
        html,
        "<title>hydro: {}</title><style>{STYLE}</style></head><body>",
        escape(&summary.subject)
    );
    let _ = write!(
        html,
        "<h1>{}</h1><p class=\"lead\">{}</p>",
        escape(&summary.subject),
        escape(&lead(summary))
    );
    if let Some(video) = video {
        let _ = write!(
            html,
            "<video controls loop muted autoplay src=\"data:{};base64,{}\"></video>\
             <p class=\"note\">The robot swims under the learned wrench; the arrow is the force on the base.</p>",
            video.mime,
            STANDARD.encode(&video.bytes)
        );
    }
    if let Some(open_loop) = &summary.open_loop {
        open_loop_section(&mut html, open_loop, &summary.subject);
    }
    closed_loop_section(&mut html, &summary.closed_loop, &summary.subject);
    if let Some(long) = &summary.long {
        long_section(&mut html, long);
    }
    step_time_section(&mut html, summary);
    provenance_section(&mut html, &summary.provenance);
    html.push_str("</body></html>\n");
    html
}

/// The result in a sentence.
fn lead(summary: &Summary) -> String {
    let mut text = String::new();
    if let Some(open_loop) = &summary.open_loop
        && let Some(row) = open_loop
            .rows
            .iter()
            .find(|row| row.name == summary.subject)
    {
        let _ = write!(
            text,
            "On {} trajectories it never saw, the wrench is wrong by {:.1} % of its standard deviation \
             ({:.1} % once buoyancy is taken out). ",
            open_loop.trajectories,
            100.0 * row.errors.pooled,
            100.0 * row.errors.pooled_hydrodynamic
        );
    }
    let closed_loop = &summary.closed_loop;
    if let Some(row) = closed_loop
        .rows
        .iter()
        .find(|row| row.name == summary.subject)
    {
        for (horizon, position) in closed_loop.horizons.iter().zip(&row.position) {
            if (horizon - 2.0).abs() < 1e-9 {
                let _ = write!(
                    text,
                    "Driving the simulation itself, the robot is {:.0} mm from where it should be after \
                     2 s (median of {} runs).",
                    1000.0 * position.median,
                    closed_loop.runs
                );
            }
        }
    }
    text
}

fn open_loop_section(html: &mut String, open_loop: &OpenLoop, subject: &str) {
    let _ = write!(
        html,
        "<h2>Open loop: wrench from recorded inputs</h2><p class=\"note\">{} test trajectories, errors against \
         the clean wrench. nRMSE: root mean square over axes of RMSE / standard deviation; the last column \
         divides by the standard deviation without buoyancy.</p>",
        open_loop.trajectories
    );
    let mut head = vec!["".to_owned()];
    head.extend(open_loop.outputs.iter().map(|axis| format!("RMSE {axis}")));
    head.extend(["nRMSE".to_owned(), "nRMSE, no buoyancy".to_owned()]);
    let rows = open_loop.rows.iter().map(|row| {
        let mut cells = vec![row.name.clone()];
        cells.extend(row.errors.rmse.iter().map(|value| format!("{value:.2}")));
        cells.extend([
            format!("{:.3}", row.errors.pooled),
            format!("{:.3}", row.errors.pooled_hydrodynamic),
        ]);
        cells
    });
    table(html, &head, rows, subject);
    let example = &open_loop.example;
    legend(html, example.wrenches.iter().map(|(name, _)| name.as_str()));
    html.push_str("<div class=\"grid\">");
    for (axis, output) in open_loop.outputs.iter().enumerate() {
        let series: Vec<Series> = example
            .wrenches
            .iter()
            .map(|(name, rows)| Series {
                name: name.clone(),
                points: example
                    .time
                    .iter()
                    .zip(rows)
                    .map(|(t, row)| (*t, row[axis]))
                    .collect(),
            })
            .collect();
        let unit = if output.starts_with("force") {
            "N"
        } else {
            "N m"
        };
        html.push_str(&plot::lines(
            &Axes {
                title: output,
                x: "time [s]",
                y: &format!("[{unit}]"),
                size: (360, 220),
                equal: false,
            },
            &series,
        ));
    }
    html.push_str("</div>");
}

fn closed_loop_section(html: &mut String, closed_loop: &ClosedLoop, subject: &str) {
    let _ = write!(
        html,
        "<h2>Closed loop: the wrench drives the simulation</h2><p class=\"note\">Same start, controls and pushes as \
         {} true runs; median over runs (mean \u{b1} standard error). The oracle applies the true wrench to the base: at its own state, computed from the \
         motion of its own simulation; replayed, as recorded, which is wrong once the motions differ. Neither applies \
         the water's torque on the leg joints, so the first is the least error that a base wrench can reach; an oracle whose \
         every step is replayed is given the recorded force of each physics step, on the base or on all joints. Joints: root \
         mean square over all. Paths are drawn while within a metre of the truth.</p>",
        closed_loop.runs
    );
    let mut head = vec![String::new()];
    head.extend(
        closed_loop
            .horizons
            .iter()
            .map(|h| format!("position, {h} s [m]")),
    );
    head.extend(
        closed_loop
            .horizons
            .iter()
            .map(|h| format!("attitude, {h} s [deg]")),
    );
    head.extend(
        closed_loop
            .horizons
            .iter()
            .map(|h| format!("joints, {h} s [deg]")),
    );
    let rows = closed_loop.rows.iter().map(|row| {
        let mut cells = vec![row.name.clone()];
        let spread = |s: &hydro_training::comparison::Spread, digits: usize| {
            if !s.mean.is_finite() {
                return format!(
                    "{:.digits$} ({} of {} diverged)",
                    s.median, row.diverged, closed_loop.runs
                );
            }
            format!(
                "{:.digits$} ({:.digits$} \u{b1} {:.digits$})",
                s.median, s.mean, s.standard_error
            )
        };
        cells.extend(row.position.iter().map(|s| spread(s, 3)));
        cells.extend(row.attitude.iter().map(|s| spread(s, 1)));
        cells.extend(row.joints.iter().map(|s| spread(s, 1)));
        cells
    });
    table(html, &head, rows, subject);
    let paths: Vec<(&str, &[[f64; 3]])> =
        std::iter::once(("truth", closed_loop.truth_path.as_slice()))
            .chain(
                closed_loop
                    .rows
                    .iter()
                    .map(|row| (row.name.as_str(), row.path.as_slice())),
            )
            .collect();
    legend(html, paths.iter().map(|(name, _)| *name));
    html.push_str("<div class=\"grid\">");
    let planes = [
        ("seen from above", 0, 1, "x [m]", "y [m]"),
        ("seen from the side", 0, 2, "x [m]", "z [m]"),
    ];
    for (title, a, b, x, y) in planes {
        let series = paths.iter().map(|(name, path)| Series {
            name: (*name).to_owned(),
            points: path
                .iter()
                .zip(&closed_loop.truth_path)
                .take_while(|(p, truth)| distance(p, truth) <= SHOWN_DISTANCE)
                .map(|(p, _)| (p[a], p[b]))
                .collect(),
        });
        let axes = Axes {
            title,
            x,
            y,
            size: (360, 300),
            equal: true,
        };
        html.push_str(&plot::lines(&axes, &series.collect::<Vec<_>>()));
    }
    let errors = closed_loop.rows.iter().map(|row| Series {
        name: row.name.clone(),
        points: row
            .path
            .iter()
            .zip(&closed_loop.truth_path)
            .zip(&closed_loop.time)
            .map(|((p, truth), t)| (*t, distance(p, truth)))
            .take_while(|(_, distance)| *distance <= SHOWN_DISTANCE)
            .collect(),
    });
    // The truth has no error; an empty line keeps the colours of the legend.
    let empty = Series {
        name: "truth".into(),
        points: Vec::new(),
    };
    let axes = Axes {
        title: "distance from the truth",
        x: "time [s]",
        y: "[m]",
        size: (360, 300),
        equal: false,
    };
    html.push_str(&plot::lines(
        &axes,
        &std::iter::once(empty).chain(errors).collect::<Vec<_>>(),
    ));
    html.push_str("</div>");
}

fn distance(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    p.iter()
        .zip(q)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}

fn long_section(html: &mut String, long: &LongRun) {
    let bounds = &long.subject;
    let oracle = long.oracle.as_ref().map(LongRunPeaks::peaks);
    let of_oracle = |at: usize| oracle.map(|peaks| peaks[at].reached);
    let _ = write!(
        html,
        "<h2>A long swim</h2><p>{} minutes under the learned wrench: {} {BOUND} times the truth's greatest values, or the oracle's where \
         those are greater (without the water's torque on the joints the legs move faster, under the oracle too).</p>",
        (bounds.duration / 60.0).round(),
        if long.within(BOUND) {
            "everything stays within"
        } else {
            "something leaves"
        }
    );
    let rows = [
        ("speed [m/s]", bounds.speed, of_oracle(0)),
        ("rate of turn [rad/s]", bounds.rate, of_oracle(1)),
        ("force [N]", bounds.force, of_oracle(2)),
        ("torque [N m]", bounds.torque, of_oracle(3)),
    ];
    let head = ["greatest", "learned", "truth", "oracle", "learned / truth"].map(str::to_owned);
    let rows = rows.iter().map(|(name, peak, oracle)| {
        vec![
            (*name).to_owned(),
            format!("{:.2}", peak.reached),
            format!("{:.2}", peak.truth),
            oracle.map_or(String::new(), |reached| format!("{reached:.2}")),
            format!("{:.2}", peak.ratio()),
        ]
    });
    table(html, &head, rows, "");
}

fn step_time_section(html: &mut String, summary: &Summary) {
    html.push_str("<h2>Time of a physics step</h2>");
    let rows = summary
        .step_times
        .iter()
        .map(|time| vec![time.name.clone(), format!("{:.1}", time.microseconds)]);
    table(
        html,
        &["".to_owned(), "[\u{b5}s]".to_owned()],
        rows,
        &summary.subject,
    );
}

fn provenance_section(html: &mut String, provenance: &[(String, String)]) {
    html.push_str("<h2>Where this comes from</h2><table>");
    for (name, value) in provenance {
        let _ = write!(
            html,
            "<tr><td>{}</td><td style=\"text-align:left\"><code>{}</code></td></tr>",
            escape(name),
            escape(value)
        );
    }
    html.push_str("</table>");
}

fn table(
    html: &mut String,
    head: &[String],
    rows: impl Iterator<Item = Vec<String>>,
    subject: &str,
) {
    html.push_str("<table><tr>");
    for cell in head {
        let _ = write!(html, "<th>{}</th>", escape(cell));
    }
    html.push_str("</tr>");
    for row in rows {
        let class = if row.first().is_some_and(|name| name == subject) {
            " class=\"subject\""
        } else {
            ""
        };
        let _ = write!(html, "<tr{class}>");
        for cell in &row {
            let _ = write!(html, "<td>{}</td>", escape(cell));
        }
        html.push_str("</tr>");
    }
    html.push_str("</table>");
}

fn legend<'a>(html: &mut String, names: impl Iterator<Item = &'a str>) {
    html.push_str("<p class=\"legend\">");
    for (index, name) in names.enumerate() {
        let colour = plot::colour(index);
        let _ = write!(
            html,
            "<span><i style=\"background:{colour}\"></i>{}</span>",
            escape(name)
        );
    }
    html.push_str("</p>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped() {
        let mut html = String::new();
        table(
            &mut html,
            &["a<b".to_owned()],
            [vec!["x&y".to_owned()]].into_iter(),
            "x&y",
        );
        assert_eq!(
            html,
            "<table><tr><th>a&lt;b</th></tr><tr class=\"subject\"><td>x&amp;y</td></tr></table>"
        );
    }
}
