//! The cross-fit: the chosen effects fitted without each of their trials, so that a trial is judged by a fit that left it out.

use crate::{
    fit::{
        hypothesis::{Fit, sum},
        linearized_problem::LinearizedProblem,
    },
    options::Options,
    output::records::WithoutTrial,
    problem::problem::Problem,
    stage::name::Naming,
};

/// True where so few trials exist, fitted and held out together, that each is judged by a fit that left it out.
pub fn is_cross_fitted(trials: usize, options: &Options) -> bool {
    trials <= options.verify.cross_fit_trials
}

/// The fit without each of its trials, by the quadratics of the others about the optimum.
pub(crate) fn cross_fit(
    problem: &Problem<'_>,
    linearized: &LinearizedProblem<'_>,
    naming: &Naming,
) -> Vec<WithoutTrial> {
    let fit = &naming.search.scored[naming.chosen].fit;
    let trials: Vec<usize> = (0..problem.trials.len())
        .filter(|trial| {
            linearized
                .problem
                .segments
                .iter()
                .any(|segment| segment.trial == *trial)
        })
        .collect();
    if trials.len() < 2 {
        return Vec::new();
    }
    let inflation = naming.search.inflation;
    // The fit without a trial, and the log density that it gives to that trial: what all trials say together
    // less what the others say. How uncertain the fit is without the trial is paid for.
    let without = |fit: &Fit, all: f64, out: usize| {
        let others = fit.quadratics.iter().enumerate();
        let others = sum(others.filter(|(at, _)| *at != out).map(|(_, of)| of)).inflated(inflation);
        let (of_others, best) = others.evidence(&fit.bounds)?;
        let mut point = fit.point.clone();
        linearized.problem.set(&mut point, &best.z);
        Some((point, all - of_others))
    };
    let empty = &naming.search.scored[0].fit;
    let (Some((all, _)), Some((all_alone, _))) =
        (fit.evidence(inflation), empty.evidence(inflation))
    else {
        return Vec::new();
    };
    (0..trials.len())
        .filter_map(|out| {
            let (point, density) = without(fit, all, out)?;
            let (nominal, alone) = without(empty, all_alone, out)?;
            Some(WithoutTrial {
                trial: problem.trials[trials[out]].name.clone(),
                nuisances: linearized.problem.nuisance_values(&point),
                effects: linearized
                    .problem
                    .entries(&point)
                    .into_iter()
                    .map(|entry| (entry.effect, entry.target, entry.parameters))
                    .collect(),
                recalibrated: linearized.problem.nuisance_values(&nominal),
                gain: density - alone,
            })
        })
        .collect()
}
