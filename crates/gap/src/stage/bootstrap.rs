//! Intervals of the fitted parameters from a bootstrap over trials.

use hydro_effects::Id;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{
    likelihood::explanation::Explanation, output::verdict::FittedParameter, stage::name::Naming,
    statistics::interval95,
};

/// Intervals from trials drawn again with replacement; the linearisation at the optimum is kept. A value that its bound
/// holds in every draw has no spread here.
pub(crate) fn bootstrap(
    explanation: &Explanation<'_>,
    naming: &Naming,
) -> Vec<(Id, String, Vec<FittedParameter>)> {
    let level = explanation.level(naming.chosen);
    let trials = level.trials.len();
    if trials < 2 {
        return Vec::new();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(explanation.problem.settings.seed);
    let draws: Vec<_> = (0..explanation.problem.settings.options.add.bootstrap_draws)
        .filter_map(|_| {
            let drawn: Vec<usize> = (0..trials).map(|_| rng.random_range(0..trials)).collect();
            let level = level.drawn(&drawn)?;
            let found = explanation.refitted(naming.chosen, &level)?;
            Some(explanation.point_of(&level, &found))
        })
        .collect();
    let mut intervals = Vec::new();
    let chosen = explanation.point(naming.chosen);
    for (row, candidate) in chosen.candidates.iter().enumerate() {
        let of = &explanation.problem.candidates[*candidate];
        let mut fitted = explanation.parameters(naming.chosen, *candidate);
        for (at, fitted) in fitted.iter_mut().enumerate() {
            let mut values: Vec<f64> = draws.iter().map(|point| point.values[row][at]).collect();
            if let Some(interval) = interval95(&mut values) {
                fitted.ci95 = interval;
            }
        }
        for (at, target) in of.targets.iter().enumerate() {
            let fitted = of.of_target(at, &fitted).to_vec();
            intervals.push((of.effect, target.clone(), fitted));
        }
    }
    intervals
}
