//! Section of the page: the text that was written into the model, and how to load it.

use std::fmt::Write as _;

use hydro_gap::{
    records::{Added, Refitted},
    verdict::{Bias, Patch, SensorPatch},
};

use super::numbers::{fine, number};
use crate::report::html::escape;

/// Bytes of the diff that the page shows; the file has it all.
const MOST_BYTES: usize = 150_000;
/// Characters of a line of the diff that the page shows: a mesh or a keyframe may be one long line.
const MOST_LETTERS: usize = 2_000;

/// The section; `patch` is `None` where nothing was added.
pub(super) fn section(html: &mut String, added: Option<&Added>, patch: Option<&Patch>) {
    let Some(patch) = patch else {
        html.push_str("<p>Nothing: the model stays as it is.</p>");
        if let Some(added) = added.filter(|added| !added.diff.trim().is_empty()) {
            html.push_str("<details><summary>What was tried and not kept</summary>");
            diff(html, &added.diff);
            html.push_str("</details>");
        }
        return;
    };
    let _ = write!(
        html,
        "<p><code>{}</code>, beside this page. To load it:</p><pre>{}</pre>",
        escape(&patch.model),
        escape(&python(&patch.model))
    );
    html.push_str(
        "<p class=\"note\">The second line is needed where the model holds a <code>hydro.</code> plugin; name the \
         library where you built it.</p>",
    );
    if let Some(added) = added
        && !added.diff.trim().is_empty()
    {
        diff(html, &added.diff);
    }
    numbers(html, added.map_or(&[], |added| &added.numbers));
    sensors(html, patch);
}

/// Values of the nominal model that the file replaces.
fn numbers(html: &mut String, numbers: &[Refitted]) {
    if numbers.is_empty() {
        return;
    }
    html.push_str(
        "<h3>Numbers of the nominal that were refitted</h3><p class=\"note\">Fitted together with the effects, \
         within the uncertainty that was declared for the nominal: no missing effect, but effects and numbers \
         are right only together.</p><div class=\"wide\"><table><tr><th class=\"t\">number</th>\
         <th>nominal</th><th>written</th><th>standard deviation</th><th class=\"t\">unit</th></tr>",
    );
    for refitted in numbers {
        let _ = write!(
            html,
            "<tr><td class=\"t\"><code>{}</code></td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td class=\"t\">{}</td></tr>",
            escape(&refitted.what),
            fine(refitted.from),
            fine(refitted.to),
            number(refitted.deviation),
            escape(&refitted.unit)
        );
    }
    html.push_str("</table></div>");
}

/// Instructions to load the model.
fn python(model: &str) -> String {
    let model = model.replace('\\', "\\\\").replace('"', "\\\"");
    format!(
        "import mujoco\n\
         mujoco.mj_loadPluginLibrary(\"libhydro_plugin.so\")\n\
         model = mujoco.MjModel.from_xml_path(\"{model}\")"
    )
}

fn diff(html: &mut String, diff: &str) {
    html.push_str("<pre class=\"diff\">");
    let mut shown = 0;
    for (index, line) in diff.lines().enumerate() {
        shown += line.len().min(MOST_LETTERS);
        if shown > MOST_BYTES {
            html.push_str("<span class=\"hunk\">\u{2026} the rest is in the file</span>");
            break;
        }
        let class = match line {
            _ if index < 2 => "hunk",
            line if line.starts_with("@@") => "hunk",
            line if line.starts_with('+') => "plus",
            line if line.starts_with('-') => "minus",
            _ => "same",
        };
        let cut: String = line.chars().take(MOST_LETTERS).collect();
        let more = if cut.len() < line.len() {
            " \u{2026}"
        } else {
            ""
        };
        let _ = write!(
            html,
            "<span class=\"{class}\">{}{more}</span>",
            escape(&cut)
        );
    }
    html.push_str("</pre>");
}

fn sensors(html: &mut String, patch: &Patch) {
    if patch.sensors.is_empty() {
        return;
    }
    html.push_str(
        "<h3>Corrections of sensors</h3><p class=\"note\">MJCF has no place for them: measured(t) = scale \
         \u{b7} sensor(t \u{2212} delay) + bias. They stand in <code>patch.sensors</code> of \
         <code>verdict.json</code>.</p><div class=\"wide\"><table><tr><th class=\"t\">sensor</th><th>bias</th>\
         <th>scale</th><th>delay [s]</th></tr>",
    );
    for (name, correction) in &patch.sensors {
        let _ = write!(html, "<tr><td class=\"t\">{}</td>", escape(name));
        for cell in cells(correction) {
            let _ = write!(html, "<td class=\"n\">{cell}</td>");
        }
        html.push_str("</tr>");
    }
    html.push_str("</table></div>");
}

fn cells(correction: &SensorPatch) -> [String; 3] {
    let biases = match &correction.bias {
        Bias::Scalar(value) => std::slice::from_ref(value),
        Bias::Vector(values) => values,
    };
    let all: Vec<String> = biases.iter().map(|value| number(*value)).collect();
    // A dash where nothing is corrected.
    let shown = |is_none: bool, text: String| if is_none { "\u{2013}".into() } else { text };
    [
        shown(biases.iter().all(|bias| *bias == 0.0), all.join(", ")),
        shown(correction.scale == 1.0, number(correction.scale)),
        shown(correction.delay == 0.0, number(correction.delay)),
    ]
}
