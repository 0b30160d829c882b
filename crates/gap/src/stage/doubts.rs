//! Doubts about a fit, for the reader: values at the end of what is plausible, numbers of the nominal far from what was said of them.

use hydro_effects::effect;
use hydro_files::rounded;

use crate::likelihood::explanation::Explanation;

/// Values of a set that have run to the end of what their effect takes to be plausible ([`runs_to`]), as one sentence: the set stands
/// for something else. Null and zero are no such ends (a motor may be dead). None where all are within.
pub(crate) fn values_at_an_edge(explanation: &Explanation<'_>, set: usize) -> Option<String> {
    let edge = explanation.problem.settings.options.name.edge;
    let point = explanation.point(set);
    let told = point.candidates.iter().flat_map(|candidate| {
        let fitted = explanation.parameters(set, *candidate);
        let candidate = &explanation.problem.candidates[*candidate];
        let parameters = candidate.parameters.iter().zip(fitted);
        parameters.filter_map(move |(p, fitted)| {
            let bounds = [p.lower, p.upper];
            // The interval of what was not fitted is all that is plausible, and tells nothing.
            let has_interval = fitted.ci95 != bounds;
            let ends = bounds.into_iter().zip(fitted.ci95);
            let mut ends = ends.filter(|(end, _)| end.is_finite() && *end != p.null && *end != 0.0);
            let is_at = !p.shapes
                && ends.any(|(end, reach)| {
                    let reaches = has_interval && reach == end;
                    runs_to(end, p.null, edge, (fitted.value, reaches))
                });
            let unit = match p.unit {
                "1" => String::new(),
                unit => format!(" {unit}"),
            };
            is_at.then(|| {
                format!(
                    "`{}` of {} on `{}` is {}{unit} (95 %: {} to {}; plausible: {} to {})",
                    p.name,
                    effect(candidate.effect).card().phrase,
                    candidate.targets.join("`, `"),
                    rounded(fitted.value),
                    rounded(fitted.ci95[0]),
                    rounded(fitted.ci95[1]),
                    rounded(p.lower),
                    rounded(p.upper),
                )
            })
        })
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| {
        format!(
            "the likeliest explanation is not named, for values are at the end of what is plausible: {}",
            told.join(", ")
        )
    })
}

/// True for a value beside the end of what is plausible, or more than half of the way from nothing to it with an interval that
/// ends there. `edge`: part of the way that is beside it; `reaches`: whether the interval ends there.
fn runs_to(end: f64, null: f64, edge: f64, (value, reaches): (f64, bool)) -> bool {
    let (way, left) = ((end - null).abs(), (value - end).abs());
    left <= edge * way || (reaches && left < 0.5 * way)
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

#[cfg(test)]
mod tests {
    use super::runs_to;

    #[test]
    fn a_value_runs_to_an_end_that_it_is_beside_or_that_its_interval_reaches() {
        let to_half = |value, reach| runs_to(0.5, 1.0, 0.04, (value, reach == 0.5));
        assert!(to_half(0.515, 0.51));
        assert!(to_half(0.55, 0.5));
        assert!(!to_half(0.55, 0.53));
        // An interval may be wide: less than half of the way is not far.
        assert!(!to_half(0.8, 0.5));
        let to_ten = |value, reach| runs_to(10.0, 0.0, 0.04, (value, reach == 10.0));
        assert!(to_ten(9.7, 9.9) && to_ten(6.0, 10.0));
        assert!(!to_ten(6.0, 9.0) && !to_ten(4.0, 10.0));
    }
}
