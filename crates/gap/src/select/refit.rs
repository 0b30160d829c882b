//! Nonlinear refits of sets of effects.

use hydro_effects::{Part, effect};

use crate::{
    error::GapError,
    fit::{hypothesis::Point, intervals, linearized_problem::LinearizedProblem, payload},
    problem::channels::MeasuredTrial,
    progress::Watch,
    select::evidence::Scored,
};

/// Refits a set; false where it does not stand.
pub(crate) fn add(
    linearized: &LinearizedProblem<'_>,
    point: Point,
    scored: &mut Vec<Scored>,
    watch: &Watch<'_>,
) -> Result<bool, GapError> {
    let options = &linearized.problem.options.search;
    let set = point.set();
    let Some(mut fit) = linearized.fit(point, watch)? else {
        return Ok(false);
    };
    for _ in 0..options.mirrored_fits {
        let mirrored = payload::mirrored(linearized.problem.candidates, &fit.point);
        let other = mirrored
            .map(|point| linearized.fit(point, watch))
            .transpose()?;
        let Some(better) = other
            .flatten()
            .filter(|other| other.cost() + options.other_optimum < fit.cost())
        else {
            break;
        };
        fit = better;
    }
    let mut delays = set.iter().filter(|of| is_delay(linearized, **of));
    let stands = delays.all(|delay| {
        let known = &intervals::parameters(linearized, &fit, *delay, 1.0)[0];
        is_resolved(linearized, known.ci95)
    });
    if stands {
        scored.push(Scored::new(set, fit));
    }
    Ok(stands)
}

pub(crate) fn is_delay(linearized: &LinearizedProblem<'_>, candidate: usize) -> bool {
    let id = linearized.problem.candidates[candidate].effect;
    matches!(effect(id).part(), Part::Sensor(part) if part.has_delay())
}

/// False where clocks, filters or step timing could explain the delay. From, to [s]: the interval of the fit alone, before
/// autocorrelation widens the one that is reported.
pub(crate) fn is_resolved(linearized: &LinearizedProblem<'_>, [from, to]: [f64; 2]) -> bool {
    let period = linearized
        .problem
        .trials
        .first()
        .map_or(0.0, MeasuredTrial::period);
    let least = (linearized.problem.options.search.least_delay * period)
        .max(linearized.problem.model.timestep);
    from >= least || to <= -least
}
