//! Intervals of the fitted parameters from a bootstrap over trials.

use hydro_effects::Id;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{
    fit::{hypothesis::sum, intervals::parameters, linearized_problem::LinearizedProblem},
    output::verdict::FittedParameter,
    problem::problem::Problem,
    stage::name::Naming,
    statistics::interval95,
};

/// Intervals from trials drawn again with replacement; the linearisation at the optimum is kept. A value that its bound
/// holds in every draw has no spread here.
pub(crate) fn bootstrap(
    problem: &Problem<'_>,
    linearized: &LinearizedProblem<'_>,
    naming: &Naming,
) -> Vec<(Id, String, Vec<FittedParameter>)> {
    let search = &naming.search;
    let fit = &search.scored[naming.chosen].fit;
    let trials = fit.quadratics.len();
    if trials < 2 {
        return Vec::new();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(problem.settings.seed);
    let draws: Vec<_> = (0..linearized.problem.options.add.bootstrap_draws)
        .filter_map(|_| {
            let drawn: Vec<usize> = (0..trials).map(|_| rng.random_range(0..trials)).collect();
            let quadratic = sum(drawn.iter().map(|at| &fit.quadratics[*at]));
            quadratic.inflated(search.inflation).best(&fit.bounds)
        })
        .map(|optimum| optimum.z)
        .collect();
    let mut at = linearized.problem.nuisances.len();
    let mut intervals = Vec::new();
    for candidate in &fit.point.candidates {
        let of = &linearized.problem.candidates[*candidate];
        let mut fitted = parameters(linearized, fit, *candidate, search.inflation);
        for (p, fitted) in of.parameters.iter().zip(&mut fitted) {
            let mut values: Vec<f64> = draws.iter().map(|z| p.null + z[at] * p.prior_sd).collect();
            if let Some(interval) = interval95(&mut values) {
                fitted.ci95 = interval;
            }
            at += 1;
        }
        for target in &of.targets {
            intervals.push((of.effect, target.clone(), fitted.clone()));
        }
    }
    intervals
}
