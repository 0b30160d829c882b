//! Which sets of effects explain the trials: sweep, search, and again about the best set until it stays.

use crate::{
    error::GapError,
    likelihood::{
        directions::Direction,
        explanation::Explanation,
        found::{Found, likeliest},
        level::Level,
        search::{Choices, Search},
        working_point::{Keep, WorkingPoint},
    },
    options::LikelihoodOptions,
    problem::problem::Problem,
    progress::Watch,
};

/// Rounds of sweep and search at most.
const ROUNDS: usize = 6;
/// Halvings of the values on which a trial blows up, at most.
const HALVINGS: usize = 5;

/// Sweeps, searches and moves the working point until the best set stays.
///
/// # Errors
/// The nominal diverges on some trial, or a stop was asked for.
pub fn explain<'p>(
    problem: &'p Problem<'p>,
    watch: &Watch<'_>,
) -> Result<Explanation<'p>, GapError> {
    let mut working = WorkingPoint::new(problem, watch)?;
    let mut explanation = None;
    for round in 0..ROUNDS {
        (watch.tell)("weighing sets of effects", round, ROUNDS);
        let directions: Vec<Direction> = (0..problem.candidates.len())
            .filter(|candidate| !working.point.candidates.contains(candidate))
            .flat_map(|candidate| problem.directions(candidate))
            .collect();
        // Without a set only starts and forces may explain the gap, or the numbers would run to their bounds for it.
        let mut swept = None;
        for _ in 0..HALVINGS {
            if working.follow()? && (round == 0 || working.settle()?) {
                swept = working.sweep(Some(&directions), Keep::Likelihood)?;
            }
            if swept.is_some() || round == 0 {
                break;
            }
            working.halve();
        }
        let Some(swept) = swept.filter(|swept| !swept.levels.is_empty()) else {
            break;
        };
        let choices =
            Choices::new(problem, &working.point, &directions).against_none(&swept.levels);
        let mut found = search(
            &swept.levels,
            &choices,
            &problem.settings.options.likelihood,
        );
        if let Some(best) = likeliest(&found) {
            let subsets = subsets(&swept.levels[best.level], &choices, best);
            found.retain(|of| !subsets.iter().any(|other| other.is(of)));
            found.extend(subsets);
        }
        found.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        // The sweep was made about the best set, settled.
        let set = working.point.set();
        let stays = round > 0 && found.first().is_some_and(|best| best.set == set);
        // A few effects at a time: the errors of form of more would be taken for others.
        let unexpected = |set: &[usize]| {
            let all = set.iter().filter(|of| !problem.priors[**of].is_expected);
            all.count()
        };
        let most = unexpected(&set) + problem.settings.options.likelihood.added;
        let Some(best) = found.iter().find(|of| unexpected(&of.set) <= most) else {
            break;
        };
        let (next, _) = swept.levels[best.level].moved(problem, &working.point, &directions, best);
        // Where nothing is likeliest so far, effects may be likelier at any level.
        if !best.set.is_empty() {
            working.look_about(swept.levels[best.level].sizes);
        }
        let about = std::mem::replace(&mut working.point, next);
        explanation = Some((about, directions, choices, swept.levels, found));
        if stays {
            break;
        }
    }
    let Some((about, directions, choices, levels, found)) = explanation else {
        return Err(diverges(problem));
    };
    Ok(Explanation::new(
        problem, about, directions, choices, levels, found,
    ))
}

/// Sets at all levels; of levels whose likelihood no set can raise near the best, the empty one alone.
fn search(levels: &[Level], choices: &Choices<'_>, options: &LikelihoodOptions) -> Vec<Found> {
    let mut order: Vec<(f64, usize)> = (levels.iter().map(Level::most)).zip(0..).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<Found> = Vec::new();
    for (_, number) in order {
        let level = &levels[number];
        let search = Search { level, choices };
        let best = likeliest(&found);
        let is_far = |best: &Found| search.most(best) < best.log_posterior - options.level_within;
        if !level.is_searched || best.is_some_and(is_far) {
            found.extend(search.whole(&[]));
        } else {
            found.extend(search.run());
        }
    }
    found
}

/// Every set of some members of a found one, at its level.
fn subsets(level: &Level, choices: &Choices<'_>, best: &Found) -> Vec<Found> {
    let search = Search { level, choices };
    (1..1_usize << best.set.len())
        .filter_map(|code| {
            let is_out = |at: &usize| code >> at & 1 == 1;
            let out: Vec<usize> = (0..best.set.len())
                .filter(is_out)
                .map(|at| best.set[at])
                .collect();
            search.without(best, &out)
        })
        .collect()
}

pub(crate) fn diverges(problem: &Problem<'_>) -> GapError {
    let trial = &problem.trials[0];
    let from = trial.times[0];
    GapError::NominalDiverges {
        trial: trial.name.clone(),
        start: from,
        after: 0.0,
        expected: trial.times[trial.times.len() - 1] - from,
        timestep: problem.model.timestep,
    }
}
