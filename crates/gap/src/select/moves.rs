//! Moves of the best set. The greedy search adds effects conditionally on those present; removals and swaps are refitted
//! here.

use crate::{
    error::GapError,
    fit::{hypothesis::Point, linearized_problem::LinearizedProblem},
    progress::Watch,
    select::{
        evidence::{self, Scored},
        refit,
    },
};

/// Removals, then swaps, then removals again where a swap was fitted. `inflate` gives the inflation of variance under the
/// sets fitted so far; returns the last.
pub(crate) fn refine(
    linearized: &LinearizedProblem<'_>,
    scored: &mut Vec<Scored>,
    mut inflation: f64,
    inflate: impl Fn(&[Scored]) -> f64,
    watch: &Watch<'_>,
) -> Result<f64, GapError> {
    // A set may win only against its parts.
    if refit_parts(linearized, scored, inflation, watch)? {
        inflation = inflate(scored);
    }
    if exchange(linearized, scored, inflation, watch)? {
        inflation = inflate(scored);
        if refit_parts(linearized, scored, inflation, watch)? {
            inflation = inflate(scored);
        }
    }
    Ok(inflation)
}

/// The point of the best set; `None` where it has fewer than two effects.
fn whole(linearized: &LinearizedProblem<'_>, scored: &[Scored], inflation: f64) -> Option<Point> {
    let best = &scored[evidence::best_of(linearized, scored, inflation)?];
    (best.set.len() > 1).then(|| best.fit.point.clone())
}

/// The best set with one of its effects exchanged for another that by itself explains nearly as much. Returns whether
/// any was fitted.
fn exchange(
    linearized: &LinearizedProblem<'_>,
    scored: &mut Vec<Scored>,
    inflation: f64,
    watch: &Watch<'_>,
) -> Result<bool, GapError> {
    let Some(whole) = whole(linearized, scored, inflation) else {
        return Ok(false);
    };
    let alone: Vec<(usize, f64, Vec<f64>)> = (scored.iter())
        .filter_map(|scored| {
            let [candidate] = scored.set[..] else {
                return None;
            };
            let worth = scored.log_posterior(linearized, inflation)?;
            Some((candidate, worth, scored.fit.point.values[0].clone()))
        })
        .collect();
    let mut exchanges = Vec::new();
    for (row, member) in whole.candidates.iter().enumerate() {
        let Some((_, of_member, _)) = alone.iter().find(|(other, ..)| other == member) else {
            continue;
        };
        for (other, worth, values) in &alone {
            let mut point = whole.without(row);
            let fits = point
                .candidates
                .iter()
                .all(|of| !evidence::clash(linearized, *of, *other));
            if other == member
                || !fits
                || of_member - worth > linearized.problem.options.search.swapped_within
            {
                continue;
            }
            point.candidates.push(*other);
            point.values.push(values.clone());
            let stands_for = evidence::mechanisms(linearized, &point.candidates);
            let is_known = |of: &[usize]| evidence::mechanisms(linearized, of) == stands_for;
            if !scored.iter().any(|scored| is_known(&scored.set)) {
                exchanges.push((of_member - worth, point));
            }
        }
    }
    exchanges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut changed = false;
    let firsts = evidence::firsts(linearized, exchanges.into_iter(), |(_, point)| {
        &point.candidates
    });
    for (_, point) in firsts
        .into_iter()
        .take(linearized.problem.options.search.refitted_additions)
    {
        changed |= refit::add(linearized, point, scored, watch)?;
    }
    Ok(changed)
}

/// Refits subsets of the best set from its values: fitted alone, a subset may have stopped in a worse optimum, and the best
/// set would win by its better start. Returns whether anything changed.
fn refit_parts(
    linearized: &LinearizedProblem<'_>,
    scored: &mut Vec<Scored>,
    inflation: f64,
    watch: &Watch<'_>,
) -> Result<bool, GapError> {
    let Some(whole) = whole(linearized, scored, inflation) else {
        return Ok(false);
    };
    let mut changed = false;
    for out in 0..whole.candidates.len() {
        let part = whole.without(out);
        let set = part.set();
        let known = scored.iter().position(|scored| scored.set == set);
        let before = known.map_or(f64::INFINITY, |at| scored[at].fit.cost());
        if linearized.cost_at(&part)?.is_none_or(|cost| cost >= before) {
            continue;
        }
        if refit::add(linearized, part, scored, watch)? {
            changed = true;
            if let Some(at) = known {
                scored.swap_remove(at);
            }
        }
    }
    Ok(changed)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::tests::{fake::RigidBody, on_hull, on_linearized, trial};
    use hydro_effects::Entry;
    use hydro_effects::Id;

    /// Hands a linearised problem of trials with these effects and the fits of sets of effects on it.
    fn with_fits(
        effects: &[Entry],
        test: impl FnOnce(&LinearizedProblem<'_>, &dyn Fn(&[Id]) -> Scored, &Watch<'_>),
    ) {
        let trials = (0..2).map(|at| trial(&format!("trial {at}"), effects, &[0.0, 0.0], at, 1.0));
        on_linearized(&RigidBody::new(), trials.collect(), |linearized, watch| {
            let fit = |ids: &[Id]| -> Scored {
                let mut point = linearized.empty().unwrap().point.clone();
                for id in ids {
                    let mut all = linearized.problem.candidates.iter();
                    let candidate = all.position(|of| of.effect == *id).unwrap();
                    point.candidates.push(candidate);
                    let parameters = linearized.problem.candidates[candidate].parameters.iter();
                    point.values.push(parameters.map(|p| p.start).collect());
                }
                Scored::new(point.set(), linearized.fit(point, watch).unwrap().unwrap())
            };
            test(linearized, &fit, watch);
        });
    }

    fn ids(linearized: &LinearizedProblem<'_>, scored: &Scored) -> Vec<Id> {
        scored
            .set
            .iter()
            .map(|at| linearized.problem.candidates[*at].effect)
            .collect()
    }

    #[test]
    fn a_member_is_exchanged_for_what_explains_nearly_as_much() {
        let effects = [
            on_hull(Id::QuadraticDrag, vec![2.0, 3.0, 3.0, 0.0, 0.0, 0.1]),
            on_hull(Id::BuoyancyOffset, vec![0.0003, 0.0, 0.0]),
        ];
        with_fits(&effects, |linearized, fit, watch| {
            let mut scored = vec![
                fit(&[]),
                fit(&[Id::LinearDrag]),
                fit(&[Id::QuadraticDrag]),
                fit(&[Id::LinearDrag, Id::BuoyancyOffset]),
            ];
            exchange(linearized, &mut scored, 1.0, watch).unwrap();
            let best = evidence::best_of(linearized, &scored, 1.0).unwrap();
            assert_eq!(scored.len(), 5);
            assert_eq!(
                ids(linearized, &scored[best]),
                [Id::QuadraticDrag, Id::BuoyancyOffset]
            );
        });
    }

    #[test]
    fn a_part_whose_own_fit_ended_elsewhere_is_fitted_from_the_whole() {
        let effects = [
            on_hull(Id::BuoyancyOffset, vec![0.02, 0.0, 0.0]),
            on_hull(Id::LinearDrag, vec![3.0, 3.0, 3.0, 0.1, 0.1, 0.1]),
        ];
        with_fits(&effects, |linearized, fit, watch| {
            let right = fit(&[Id::BuoyancyOffset]);
            // One that ended far above.
            let mut stuck = right.fit.clone();
            stuck.misfit += 1e9;
            stuck.quadratics[0].q += 1e9;
            let whole = fit(&[Id::LinearDrag, Id::BuoyancyOffset]);
            let stuck = Scored::new(right.set.clone(), stuck);
            let mut scored = vec![fit(&[]), stuck, fit(&[Id::LinearDrag]), whole];
            // Once: what stands is no better from there.
            for changes in [true, false] {
                assert_eq!(evidence::best_of(linearized, &scored, 1.0), Some(3));
                let changed = refit_parts(linearized, &mut scored, 1.0, watch).unwrap();
                assert_eq!((changed, scored.len()), (changes, 4));
                let apart = scored[1].fit.misfit / right.fit.misfit;
                assert!((apart - 1.0).abs() < 0.01, "{apart}");
            }
        });
    }
}
