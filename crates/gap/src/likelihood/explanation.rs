//! What the trials say: the posterior of sets of effects, and the values of each.

use std::collections::BTreeMap;

use crate::{
    likelihood::directions::Direction,
    likelihood::{
        found::Found,
        level::Level,
        search::{Choices, Search, log_sum},
        truncated_evidence::Truncated,
        truncated_normal::HALF_WIDTH,
    },
    output::verdict::FittedParameter,
    problem::{point::Point, problem::Problem},
};
use hydro_effects::{Id, effect};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Posterior of sets of effects, linear about the best.
pub struct Explanation<'a> {
    pub(crate) problem: &'a Problem<'a>,
    /// The point of the last sweep, and the directions that it looked along.
    about: Point,
    directions: Vec<Direction>,
    choices: Choices,
    pub(crate) levels: Vec<Level>,
    /// Every set at every level that was tried.
    found: Vec<Found>,
    /// The same by effects and targets, the likeliest first.
    pub(crate) sets: Vec<SetPosterior>,
}

/// All forms of a set of effects, at all levels of unmodelled forces.
#[derive(Clone, Debug)]
pub(crate) struct SetPosterior {
    /// Candidates of the likeliest form, ascending.
    pub(crate) set: Vec<usize>,
    /// Row of the likeliest form and level.
    best: usize,
    /// Log posterior, up to the constant that all sets share.
    pub(crate) log_posterior: f64,
    pub(crate) probability: f64,
}

impl std::fmt::Debug for Explanation<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Explanation")
            .field("sets", &self.sets.len())
            .finish_non_exhaustive()
    }
}

impl<'a> Explanation<'a> {
    pub(crate) fn new(
        problem: &'a Problem<'a>,
        about: Point,
        directions: Vec<Direction>,
        choices: Choices,
        levels: Vec<Level>,
        found: Vec<Found>,
    ) -> Self {
        let sets = posterior(problem, &found);
        Self {
            problem,
            about,
            directions,
            choices,
            levels,
            found,
            sets,
        }
    }

    /// The set of no effect.
    pub(crate) fn nothing(&self) -> usize {
        let is_empty = |of: &SetPosterior| of.set.is_empty();
        self.sets.iter().position(is_empty).unwrap_or(0)
    }

    /// Log posterior of a set by level of unmodelled forces.
    fn by_level(&self, set: usize) -> Vec<(f64, f64)> {
        let same = mechanisms(self.problem, &self.sets[set].set);
        let mut by_level: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for found in &self.found {
            if mechanisms(self.problem, &found.set) == same {
                by_level
                    .entry(found.level)
                    .or_default()
                    .push(found.log_posterior);
            }
        }
        by_level
            .into_iter()
            .map(|(level, logs)| (self.levels[level].force, log_sum(logs.iter().copied())))
            .collect()
    }

    /// Uncertain numbers of the nominal refitted without effects, to all trials or all but one.
    pub(crate) fn recalibrated(&self, without: Option<usize>) -> Vec<f64> {
        let nothing = self.nothing();
        let others = without.and_then(|trial| self.level(nothing).without(trial));
        let level = others.as_ref().unwrap_or(self.level(nothing));
        let found = self.refitted(nothing, level);
        let point = found.map(|found| self.point_of(level, &found));
        let point = point.unwrap_or_else(|| self.problem.origin());
        self.problem.nuisance_values(&point)
    }

    /// Values of a set, and uncertain numbers of the nominal beside it.
    pub(crate) fn point(&self, set: usize) -> Point {
        let found = &self.found[self.sets[set].best];
        let level = &self.levels[found.level];
        level
            .moved(self.problem, &self.about, &self.directions, found)
            .0
    }

    /// Level at which a set is likeliest.
    pub(crate) fn level(&self, set: usize) -> &Level {
        &self.levels[self.found[self.sets[set].best].level]
    }

    /// A set on the likelihood of other trials, members in the forms and at the scales that all trials prefer.
    pub(crate) fn refitted(&self, set: usize, level: &Level) -> Option<Found> {
        self.again(&self.found[self.sets[set].best], level)
    }

    /// The point at a set refitted on other trials.
    pub(crate) fn point_of(&self, level: &Level, found: &Found) -> Point {
        level
            .moved(self.problem, &self.about, &self.directions, found)
            .0
    }

    /// Values with their 95 % intervals, of one candidate of a set.
    pub(crate) fn parameters(&self, set: usize, candidate: usize) -> Vec<FittedParameter> {
        let found = &self.found[self.sets[set].best];
        let point = self.point(set);
        let Some(row) = point.candidates.iter().position(|of| *of == candidate) else {
            return Vec::new();
        };
        let deviations = self.deviations(found, candidate);
        let parameters = self.problem.candidates[candidate].parameters.iter();
        parameters
            .zip(&point.values[row])
            .zip(deviations)
            .map(|((p, value), deviation)| FittedParameter {
                name: p.name.clone(),
                value: *value,
                unit: p.unit.to_owned(),
                ci95: deviation.map_or([p.lower, p.upper], |deviation| {
                    let half = HALF_WIDTH * deviation * p.prior_sd;
                    [
                        (value - half).clamp(p.lower, p.upper),
                        (value + half).clamp(p.lower, p.upper),
                    ]
                }),
            })
            .collect()
    }

    /// Standard deviations of a candidate's parameters in those of the prior: of the data, and of the form where the effect
    /// idealises. None for what was not fitted.
    fn deviations(&self, found: &Found, candidate: usize) -> Vec<Option<f64>> {
        let parameters = &self.problem.candidates[candidate].parameters;
        let mut deviations = vec![None; parameters.len()];
        let Some(Truncated {
            mean, covariance, ..
        }) = &found.posterior
        else {
            return deviations;
        };
        let idealised = effect(self.problem.candidates[candidate].effect)
            .card()
            .idealised;
        let own: usize = self.about.values.iter().map(Vec::len).sum();
        let mut first = 0;
        let mut columns: BTreeMap<usize, usize> = BTreeMap::new();
        for (of, values) in self.about.candidates.iter().zip(&self.about.values) {
            if *of == candidate {
                columns.extend((0..values.len()).map(|at| (first + at, at)));
            }
            first += values.len();
        }
        for (at, direction) in self.directions.iter().enumerate() {
            if direction.candidate == candidate {
                columns.insert(own + at, direction.parameter);
            }
        }
        let relative = self.problem.settings.options.likelihood.form_error;
        for (row, column) in found.columns.iter().enumerate() {
            if let Some(parameter) = columns.get(column) {
                let form = match idealised && !parameters[*parameter].shapes {
                    true => relative * mean[row],
                    false => 0.0,
                };
                let variance = covariance[(row, row)].max(0.0) + form * form;
                deviations[*parameter] = Some(variance.sqrt());
            }
        }
        deviations
    }

    /// Name, value and standard deviation of every uncertain number of the nominal beside a set, in the number's unit.
    pub(crate) fn nuisances(&self, set: usize) -> Vec<(String, f64, f64)> {
        let point = self.point(set);
        let found = &self.found[self.sets[set].best];
        let spread = self.level(set).spread(found);
        self.problem
            .nuisances
            .iter()
            .enumerate()
            .map(|(at, (nuisance, sd))| {
                let name = self.problem.model.nuisances[*nuisance].name.clone();
                let deviation = spread.as_ref().map_or(1.0, |spread| spread[at]);
                (name, point.nuisances[at] * sd, deviation * sd)
            })
            .collect()
    }

    /// Probability that a candidate is missing.
    pub(crate) fn candidates(&self) -> BTreeMap<usize, f64> {
        let total = log_sum(self.found.iter().map(|of| of.log_posterior));
        let mut sums = BTreeMap::new();
        for found in &self.found {
            for candidate in &found.set {
                *sums.entry(*candidate).or_insert(0.0) += (found.log_posterior - total).exp();
            }
        }
        sums
    }

    /// Probability that an effect is missing, on whatever target.
    pub(crate) fn ids(&self) -> BTreeMap<Id, f64> {
        let mut sums = BTreeMap::new();
        for set in &self.sets {
            let mut ids: Vec<Id> = self.effects(&set.set);
            ids.sort_unstable();
            ids.dedup();
            for id in ids {
                *sums.entry(id).or_insert(0.0) += set.probability;
            }
        }
        sums
    }

    /// Effects of a set of candidates.
    pub(crate) fn effects(&self, set: &[usize]) -> Vec<Id> {
        set.iter()
            .map(|candidate| self.problem.candidates[*candidate].effect)
            .collect()
    }

    /// Explained deviance of a set without some of its candidates: the part of the log likelihood lost without effects, against
    /// the best beside unmodelled forces of any size, that the set regains beside the least of them.
    pub(crate) fn explained(&self, set: usize, without: &[usize]) -> f64 {
        let [nothing, best] = self.extremes();
        let least = &self.levels[0];
        let of = |found: &Found| {
            let found = self.again(found, least);
            found.map_or(f64::NEG_INFINITY, |found| found.log_likelihood)
        };
        let chosen = &self.found[self.sets[set].best];
        let some = self.search(0).without(chosen, without);
        some.map_or(0.0, |some| {
            share(of(&some), of(nothing), best.log_likelihood)
        })
    }

    /// Probabilities of no effect: that simulation and measurement agree, and that forces are missing that no effect models.
    pub(crate) fn without_effects(&self) -> (f64, f64) {
        let nothing = self.nothing();
        let set = &self.sets[nothing];
        let by_level = self.by_level(nothing);
        let least = by_level.first().map_or(0.0, |(_, log)| *log);
        // Forces count as seen where they are not negligible and the trials so much likelier with them.
        let options = &self.problem.settings.options.name;
        let seen = -options.error.ln();
        let (mut agreement, mut unmodelled) = (0.0, 0.0);
        for (force, log) in by_level {
            let p = set.probability * (log - set.log_posterior).exp();
            if log - least > seen && force > options.negligible_force {
                unmodelled += p;
            } else {
                agreement += p;
            }
        }
        (agreement, unmodelled)
    }

    /// Log odds of any gap.
    pub(crate) fn odds(&self) -> f64 {
        let (agreement, _) = self.without_effects();
        ((1.0 - agreement).max(0.0) / agreement.max(f64::MIN_POSITIVE)).ln()
    }

    /// The empty set, and the set of the greatest likelihood at any level.
    fn extremes(&self) -> [&Found; 2] {
        let mut best = &self.found[0];
        for found in &self.found {
            if found.log_likelihood > best.log_likelihood {
                best = found;
            }
        }
        [&self.found[self.sets[self.nothing()].best], best]
    }

    fn search(&self, number: usize) -> Search<'_> {
        Search {
            level: &self.levels[number],
            number,
            choices: &self.choices,
        }
    }

    /// A set on another likelihood.
    fn again(&self, found: &Found, level: &Level) -> Option<Found> {
        let search = Search {
            level,
            number: found.level,
            choices: &self.choices,
        };
        search.again(found)
    }

    /// What the search finds in simulated trials in which a set is true, its values drawn from their posterior: the likeliest
    /// sets, and the log odds of any effect against none.
    pub(crate) fn simulated(
        &self,
        set: usize,
        largest: usize,
        draws: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<(Vec<usize>, f64)> {
        let found = &self.found[self.sets[set].best];
        let level = &self.levels[found.level];
        let Some(simulator) = level.simulator(found) else {
            return Vec::new();
        };
        let choices = self.choices.up_to(largest);
        let levels: Vec<Level> = (0..draws).map(|_| simulator.draw(rng)).collect();
        levels
            .par_iter()
            .map(|level| {
                let search = Search {
                    level,
                    number: 0,
                    choices: &choices,
                };
                let all = search.run();
                let nothing = all.iter().find(|of| of.set.is_empty());
                let nothing = nothing.map_or(f64::NEG_INFINITY, |of| of.log_posterior);
                let some = all.iter().filter(|of| !of.set.is_empty());
                let odds = log_sum(some.map(|of| of.log_posterior)) - nothing;
                let best = all
                    .iter()
                    .max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior));
                (best.map_or_else(Vec::new, |of| of.set.clone()), odds)
            })
            .collect()
    }
}

/// Part of the way from nothing to the best.
fn share(of: f64, nothing: f64, best: f64) -> f64 {
    ((of - nothing) / (best - nothing).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

/// Sets by effects and targets, the likeliest first.
fn posterior(problem: &Problem<'_>, found: &[Found]) -> Vec<SetPosterior> {
    let total = log_sum(found.iter().map(|of| of.log_posterior));
    let mut rows: BTreeMap<Vec<(Id, &[String])>, Vec<usize>> = BTreeMap::new();
    for (row, of) in found.iter().enumerate() {
        rows.entry(mechanisms(problem, &of.set))
            .or_default()
            .push(row);
    }
    let mut sets: Vec<SetPosterior> = rows
        .into_values()
        .filter_map(|rows| {
            let log = |row: &usize| found[*row].log_posterior;
            let best = *rows.iter().max_by(|a, b| log(a).total_cmp(&log(b)))?;
            let whole = log_sum(rows.iter().map(log));
            Some(SetPosterior {
                set: found[best].set.clone(),
                best,
                log_posterior: whole,
                probability: (whole - total).exp(),
            })
        })
        .collect();
    sets.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    sets
}

/// Effects and targets of a set, whatever the forms of its candidates.
pub(crate) fn mechanisms<'b>(problem: &'b Problem<'_>, set: &[usize]) -> Vec<(Id, &'b [String])> {
    let mut mechanisms: Vec<_> = set
        .iter()
        .map(|at| problem.candidates[*at].mechanism())
        .collect();
    mechanisms.sort_unstable();
    mechanisms
}
