//! The cross-fit: the chosen effects fitted without each of their trials, so that a trial is judged by a fit that left it out.

use crate::{
    likelihood::explanation::Explanation,
    options::Options,
    output::records::WithoutTrial,
    stage::{name::Naming, own_values},
};

/// True where so few trials exist, fitted and held out together, that each is judged by a fit that left it out.
pub fn is_cross_fitted(trials: usize, options: &Options) -> bool {
    trials <= options.verify.cross_fit_trials
}

/// The fit without each of its trials, and the log density that it gives to that trial: what all trials say together less
/// what the others say. How uncertain the fit is without the trial is paid for.
pub(crate) fn cross_fit(explanation: &Explanation<'_>, naming: &Naming) -> Vec<WithoutTrial> {
    let problem = explanation.problem;
    let trials = problem.trials.len();
    if trials < 2 {
        return Vec::new();
    }
    let without = |set: usize, out: usize| {
        let level = explanation.level(set);
        let others = level.without(out)?;
        let all = explanation.refitted(set, level)?.log_likelihood;
        let found = explanation.refitted(set, &others)?;
        // What first order about another set makes of this one is shared out over the trials.
        let overstated = (all - explanation.log_likelihood(set)) / trials as f64;
        let density = all - found.log_likelihood - overstated;
        Some((explanation.point_of(&others, &found), density))
    };
    let nothing = explanation.nothing();
    (0..trials)
        .filter_map(|out| {
            let (point, density) = without(naming.chosen, out)?;
            let (_, alone) = without(nothing, out)?;
            Some(WithoutTrial {
                trial: problem.trials[out].name.clone(),
                nuisances: problem.nuisance_values(&point),
                effects: own_values::effects(problem, &point),
                recalibrated: explanation.recalibrated(Some(out)),
                gain: density - alone,
            })
        })
        .collect()
}
