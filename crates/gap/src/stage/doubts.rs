//! Doubts about a fit, for the reader: values at the end of what is plausible, numbers of the nominal far from what was said of them.

use hydro_effects::effect;
use hydro_files::rounded;

use crate::likelihood::{edge::Edge, explanation::Explanation};

/// Values of a set at the end of what is plausible, for which it is not named, as one sentence; none where all are within.
pub(crate) fn values_at_an_edge(explanation: &Explanation<'_>, set: usize) -> Option<String> {
    let edges = explanation.edges(set);
    (!edges.is_empty()).then(|| {
        format!(
            "the likeliest explanation is not named, for values are at the end of what is plausible: {}",
            told(explanation, &edges)
        )
    })
}

/// Such values of a likelier set, whose effects were left out, as one sentence; none where there are none.
pub(crate) fn left_out(explanation: &Explanation<'_>) -> Option<String> {
    let edges = &explanation.left_out;
    (!edges.is_empty()).then(|| {
        format!(
            "beyond what is named something is left that no effect of the catalogue explains: the readings would be likelier with values \
             at the end of what is plausible, which were left out: {}",
            told(explanation, edges)
        )
    })
}

/// Values at the end of what is plausible, with their intervals.
fn told(explanation: &Explanation<'_>, edges: &[Edge]) -> String {
    let told = edges.iter().map(|edge| {
        let candidate = &explanation.problem.candidates[edge.candidate];
        let fitted = &edge.fitted;
        let unit = match fitted.unit.as_str() {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        format!(
            "`{}` of {} on `{}` is {}{unit} (95 %: {} to {}; plausible: {} to {})",
            fitted.name,
            effect(candidate.effect).card().phrase,
            candidate.targets_of(edge.parameter).join("`, `"),
            rounded(fitted.value),
            rounded(fitted.ci95[0]),
            rounded(fitted.ci95[1]),
            rounded(edge.plausible[0]),
            rounded(edge.plausible[1]),
        )
    });
    told.collect::<Vec<String>>().join(", ")
}

/// Numbers of the nominal that the fit of a set moves far beyond their uncertainty, the farthest first, as one sentence; none
/// where all are near.
pub(crate) fn far_numbers(explanation: &Explanation<'_>, set: usize) -> Option<String> {
    let problem = explanation.problem;
    let least = problem.settings.options.name.far;
    let point = explanation.point(set);
    let all = problem.nuisances.iter().zip(point.nuisances.iter());
    let mut far: Vec<(&str, f64)> = all
        .filter(|(_, shift)| shift.abs() >= least)
        .map(|((of, _), shift)| (problem.model.nuisances[*of].name.as_str(), *shift))
        .collect();
    far.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let told = far
        .iter()
        .map(|(name, shift)| format!("`{name}` by {shift:+.1}"));
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| {
        format!(
            "the fit moves numbers of the nominal farther than they are uncertain, in standard deviations: {}; they are less well known \
             than was said (--uncertainty), or stand for something else that is missing, and what acts like them may be wrong by more \
             than its interval",
            told.join(", ")
        )
    })
}
