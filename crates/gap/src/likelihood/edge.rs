//! Fitted values at the end of what their effect takes to be plausible: a set that has them stands for something else.

use hydro_effects::Parameter;

use crate::output::verdict::FittedParameter;

/// Such a value.
#[derive(Clone, Debug)]
pub(crate) struct Edge {
    pub(crate) candidate: usize,
    /// Its place among the candidate's parameters.
    pub(crate) parameter: usize,
    pub(crate) fitted: FittedParameter,
    /// Least and largest plausible value.
    pub(crate) plausible: [f64; 2],
}

impl Edge {
    /// A candidate's value, if it has run to such an end ([`runs_to`]). Null and zero are no such ends (a motor may be dead). `edge`:
    /// part of the way to the end that is beside it.
    pub(super) fn of(
        (candidate, parameter): (usize, usize),
        p: &Parameter,
        fitted: FittedParameter,
        edge: f64,
    ) -> Option<Self> {
        let bounds = [p.lower, p.upper];
        // The interval of what was not fitted is all that is plausible, and tells nothing.
        let has_interval = fitted.ci95 != bounds;
        let ends = bounds.into_iter().zip(fitted.ci95);
        let mut ends = ends.filter(|(end, _)| end.is_finite() && *end != p.null && *end != 0.0);
        let is_there = !p.shapes
            && ends.any(|(end, reach)| {
                let reaches = has_interval && reach == end;
                runs_to(end, p.null, edge, (fitted.value, reaches))
            });
        is_there.then_some(Self {
            candidate,
            parameter,
            fitted,
            plausible: bounds,
        })
    }
}

/// True for a value beside the end of what is plausible, or more than half of the way from nothing to it with an interval that
/// ends there. `edge`: part of the way that is beside it; `reaches`: whether the interval ends there.
fn runs_to(end: f64, null: f64, edge: f64, (value, reaches): (f64, bool)) -> bool {
    let (way, left) = ((end - null).abs(), (value - end).abs());
    left <= edge * way || (reaches && left < 0.5 * way)
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
