//! Values of a trial's own that nobody fitted: estimated on the first half of the trial, so that the second half judges them.

use std::collections::BTreeMap;

use hydro_effects::Id;
use nalgebra::DVector;

use crate::{
    error::GapError,
    likelihood::{by_trial::Deviation, explanation::Explanation, working_point::WorkingPoint},
    output::records::{OwnFit, WithoutTrial},
    plant::Plant,
    problem::{
        channels::Channels,
        point::Point,
        problem::{Problem, Settings},
    },
    progress::Watch,
    trial::Trial,
};

/// Linearisations about the values found last.
const ROUNDS: usize = 2;

/// Fit of all trials, where a chosen effect has values of each trial's own.
pub(crate) fn of_fit(explanation: &Explanation<'_>, chosen: usize) -> Option<OwnFit> {
    let point = explanation.point(chosen);
    let spread = explanation.spread_by_trial(chosen);
    if spread.is_empty() {
        return None;
    }
    let problem = explanation.problem;
    let spread = spread.into_iter().map(|(candidate, spread)| {
        let of = &problem.candidates[candidate];
        (of.effect, of.targets.clone(), spread)
    });
    Some(OwnFit {
        fit: WithoutTrial {
            trial: String::new(),
            nuisances: problem.nuisance_values(&point),
            effects: effects(problem, &point),
            recalibrated: explanation.recalibrated(None),
            gain: 0.0,
        },
        spread: spread.collect(),
    })
}

/// Effects of a point as a fit is recorded.
pub(crate) fn effects(problem: &Problem<'_>, point: &Point) -> Vec<(Id, String, Vec<f64>)> {
    (problem.entries(point).into_iter())
        .map(|entry| (entry.effect, entry.target, entry.parameters))
        .collect()
}

/// A fit with the values of a trial's own, as its first half has them, and when the second half begins [s]. `None` where the
/// simulation blows up.
///
/// # Errors
/// The trial cannot be prepared, the plant refuses, or a stop was asked for.
pub(crate) fn estimate(
    plant: &dyn Plant,
    trial: &Trial,
    (fit, own): (&WithoutTrial, &OwnFit),
    channels: &Channels,
    settings: &Settings,
    watch: &Watch<'_>,
) -> Result<Option<(WithoutTrial, f64)>, GapError> {
    let quiet = Watch::silent(watch.stop);
    let mut problem = Problem::prepare(plant, vec![trial.clone()], settings.clone(), &quiet)?;
    for channel in &mut problem.channels.list {
        let known = channels.list.iter();
        let mut known = known.filter(|of| of.sensor == channel.sensor);
        if let Some(of) = known.find(|of| of.component == channel.component) {
            channel.noise = of.noise;
        }
    }
    let Some(mut point) = point(&problem, fit) else {
        return Ok(None);
    };
    let directions = deviations(&problem, &point, own);
    let half = problem.trials[0].times.len() / 2;
    let from = problem.trials[0].times[half];
    for _ in 0..ROUNDS {
        let mut working = WorkingPoint::new(&problem, &quiet)?;
        working.keep_rows(half);
        working.point = point.clone();
        let Some(z) = working.own_values(&directions)? else {
            return Ok(None);
        };
        let mut first = problem.nuisances.len();
        for (row, candidate) in point.candidates.clone().into_iter().enumerate() {
            let parameters = &problem.candidates[candidate].parameters;
            let mut values = point.values[row].clone();
            for (at, p) in parameters.iter().enumerate().filter(|(_, p)| !p.shapes) {
                values[at] = (p.null + z[first + at] * p.prior_sd).clamp(p.lower, p.upper);
            }
            first += parameters.len();
            point.by_trial[row] = BTreeMap::from([(0, values)]);
        }
    }
    let fit = WithoutTrial {
        effects: effects(&problem, &point.in_trial(0)),
        ..fit.clone()
    };
    Ok(Some((fit, from)))
}

/// The point of a fit. `None` where a trial knows no such effect.
fn point(problem: &Problem<'_>, fit: &WithoutTrial) -> Option<Point> {
    let mut point = problem.origin();
    let used = problem
        .nuisances
        .iter()
        .map(|(of, sd)| fit.nuisances.get(*of).map(|value| value / sd));
    point.nuisances = DVector::from_vec(used.collect::<Option<Vec<f64>>>()?);
    for (effect, target, values) in &fit.effects {
        let is_it = |at: &usize| {
            let of = &problem.candidates[*at];
            of.effect == *effect && of.targets == [target.clone()] && of.left_out.is_empty()
        };
        point
            .candidates
            .push((0..problem.candidates.len()).find(is_it)?);
        point.values.push(values.clone());
        point.forms.push([1.0; 2]);
        point.by_trial.push(BTreeMap::new());
    }
    Some(point)
}

/// Directions of the deviations among uncertain numbers and the point's own parameters.
fn deviations(problem: &Problem<'_>, point: &Point, own: &OwnFit) -> Vec<Deviation> {
    let mut first = problem.nuisances.len();
    let mut directions = Vec::new();
    for candidate in &point.candidates {
        let of = &problem.candidates[*candidate];
        let mut spread = own.spread.iter();
        let spread = spread.find(|(effect, targets, _)| of.mechanism() == (*effect, &targets[..]));
        for (at, p) in of.parameters.iter().enumerate() {
            let sd = spread.and_then(|of| of.2.get(at)).copied().unwrap_or(0.0);
            if sd > 0.0 {
                directions.push(vec![(first + at, sd / p.prior_sd)]);
            }
        }
        first += of.parameters.len();
    }
    directions
}
