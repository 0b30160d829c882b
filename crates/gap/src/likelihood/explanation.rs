//! Posterior of sets of effects given the trials, and the values of each.

use std::collections::BTreeMap;

use hydro_effects::{Id, Parameter};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::{
    likelihood::{
        choices::Choices,
        directions::Direction,
        edge::Edge,
        followed::Followed,
        found::{Found, likeliest},
        level::Level,
        search::{Search, log_sum},
        truncated_normal::HALF_WIDTH,
    },
    output::verdict::FittedParameter,
    problem::{point::Point, problem::Problem},
};

/// Posterior of sets of effects, linear about the best.
pub struct Explanation<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) followed: &'a Followed<'a>,
    /// The point of the last sweep, and the directions that it looked along.
    about: Point,
    directions: Vec<Direction>,
    choices: Choices<'a>,
    pub(crate) levels: Vec<Level>,
    /// Likelihoods of predictions over a segment's length: beside the least unmodelled forces, and beside likely ones.
    predictions: Vec<Level>,
    /// Every set at every level that was tried, and the sum of their posteriors.
    found: Vec<Found>,
    log_total: f64,
    /// The same by effects and targets, the likeliest first.
    pub(crate) sets: Vec<SetPosterior>,
    /// Values at the end of what is plausible that a likelier set has, whose effects were left out.
    pub(crate) left_out: Vec<Edge>,
}

/// All forms of a set of effects, at all levels of disturbances.
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
        followed: &'a Followed<'a>,
        about: Point,
        directions: Vec<Direction>,
        choices: Choices<'a>,
        (levels, predictions): (Vec<Level>, Vec<Level>),
        found: Vec<Found>,
    ) -> Self {
        let problem = followed.problem;
        let log_total = log_sum(found.iter().map(|of| of.log_posterior));
        let sets = posterior(problem, &found, log_total);
        Self {
            problem,
            followed,
            about,
            directions,
            choices,
            levels,
            predictions,
            found,
            log_total,
            sets,
            left_out: Vec::new(),
        }
    }

    /// The likeliest set of any effect.
    pub(crate) fn best(&self) -> Option<usize> {
        let nothing = self.nothing();
        (0..self.sets.len()).find(|row| *row != nothing)
    }

    /// The set of no effect.
    pub(crate) fn nothing(&self) -> usize {
        let is_empty = |of: &SetPosterior| of.set.is_empty();
        self.sets.iter().position(is_empty).unwrap_or(0)
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

    /// A set in its likeliest form, at its likeliest level.
    fn found(&self, set: usize) -> &Found {
        &self.found[self.sets[set].best]
    }

    /// Log likelihood of a set in its likeliest form, at its likeliest level.
    pub(crate) fn log_likelihood(&self, set: usize) -> f64 {
        self.found(set).log_likelihood
    }

    /// True for the set about which the readings were linearised last.
    pub(crate) fn is_linearised_about(&self, set: usize) -> bool {
        self.sets[set].set == self.about.set()
    }

    /// Level at which a set is likeliest.
    pub(crate) fn level(&self, set: usize) -> &Level {
        &self.levels[self.found(set).level]
    }

    /// Values of a set, and uncertain numbers of the nominal beside it.
    pub(crate) fn point(&self, set: usize) -> Point {
        self.point_of(self.level(set), self.found(set))
    }

    fn search<'s>(&'s self, level: &'s Level) -> Search<'s> {
        Search {
            level,
            choices: &self.choices,
        }
    }

    /// A set on the likelihood of other trials, members in the forms and at the scales that all trials prefer.
    pub(crate) fn refitted(&self, set: usize, level: &Level) -> Option<Found> {
        self.search(level).again(self.found(set))
    }

    /// The point at a set refitted on other trials.
    pub(crate) fn point_of(&self, level: &Level, found: &Found) -> Point {
        level
            .moved(self.problem, &self.about, &self.directions, found)
            .0
    }

    /// Values with their 95 % intervals, of one candidate of a set.
    pub(crate) fn parameters(&self, set: usize, candidate: usize) -> Vec<FittedParameter> {
        let point = self.point(set);
        let Some(row) = point.candidates.iter().position(|of| *of == candidate) else {
            return Vec::new();
        };
        let deviations = self.deviations(self.found(set), candidate);
        let by_trial = |at: usize, p: &Parameter| -> BTreeMap<String, f64> {
            if p.shapes {
                return BTreeMap::new();
            }
            let trials = point.by_trial[row].iter();
            let named =
                trials.map(|(of, values)| (self.problem.trials[*of].name.clone(), values[at]));
            named.collect()
        };
        let parameters = self.problem.candidates[candidate].parameters.iter();
        parameters
            .enumerate()
            .zip(&point.values[row])
            .zip(deviations)
            .map(|(((at, p), value), deviation)| FittedParameter {
                by_trial: by_trial(at, p),
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

    /// Values of a set that have run to the end of what is plausible.
    pub(crate) fn edges(&self, set: usize) -> Vec<Edge> {
        let part = self.problem.settings.options.name.edge;
        let candidates = self.sets[set].set.iter();
        let edges = candidates.flat_map(|candidate| {
            let of = &self.problem.candidates[*candidate];
            let fitted = of.parameters.iter().zip(self.parameters(set, *candidate));
            // A joint that does not rub has no value to run anywhere.
            let acts = |p: &Parameter, fitted: &FittedParameter| {
                !of.is_apart || p.null < fitted.ci95[0] || p.null > fitted.ci95[1]
            };
            let fitted = fitted
                .enumerate()
                .filter(move |(_, (p, fitted))| acts(p, fitted));
            fitted.filter_map(move |(at, (p, fitted))| Edge::of((*candidate, at), p, fitted, part))
        });
        edges.collect()
    }

    /// Candidates of a set with values of each trial's own: standard deviation of each parameter about the common value, in its
    /// unit.
    pub(crate) fn spread_by_trial(&self, set: usize) -> Vec<(usize, Vec<f64>)> {
        let options = &self.problem.settings.options.likelihood;
        let members = self.found(set).members.iter();
        let own = members.filter_map(|(candidate, _, scale, size)| {
            let sd = options.prior_scales[*scale] * options.own_sizes[(*size)?];
            let parameters = self.problem.candidates[*candidate].parameters.iter();
            let spread = parameters.map(|p| if p.shapes { 0.0 } else { sd * p.prior_sd });
            Some((*candidate, spread.collect()))
        });
        own.collect()
    }

    /// Standard deviations of a candidate's parameters in those of the prior: of the data, and of the form where the effect
    /// idealises. None for what was not fitted.
    fn deviations(&self, found: &Found, candidate: usize) -> Vec<Option<f64>> {
        let of = &self.problem.candidates[candidate];
        let mut deviations = vec![None; of.parameters.len()];
        let own: usize = self.about.values.iter().map(Vec::len).sum();
        let mut first = 0;
        let mut columns: BTreeMap<usize, usize> = BTreeMap::new();
        for (held, values) in self.about.candidates.iter().zip(&self.about.values) {
            if *held == candidate {
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
                let posterior = &found.posterior;
                let form = if of.has_form_error(&of.parameters[*parameter]) {
                    relative * posterior.mean[row]
                } else {
                    0.0
                };
                let variance = posterior.covariance[(row, row)].max(0.0) + form * form;
                deviations[*parameter] = Some(variance.sqrt());
            }
        }
        deviations
    }

    /// Name, value and standard deviation of every uncertain number of the nominal beside a set, in the number's unit.
    pub(crate) fn nuisances(&self, set: usize) -> Vec<(String, f64, f64)> {
        let point = self.point(set);
        let (level, found) = (self.level(set), self.found(set));
        let own = self.search(level).precision(&found.members);
        let spread = level.spread(found, &own);
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

    fn probability(&self, found: &Found) -> f64 {
        (found.log_posterior - self.log_total).exp()
    }

    /// Probability that a candidate is missing.
    pub(crate) fn candidates(&self) -> BTreeMap<usize, f64> {
        let mut sums = BTreeMap::new();
        for found in &self.found {
            for candidate in &found.set {
                *sums.entry(*candidate).or_insert(0.0) += self.probability(found);
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

    /// Explained deviance of a set without some of its candidates: the part of the log likelihood of predictions over a segment's
    /// length that is lost without effects, against the best beside likely unmodelled forces, and that the set regains beside the
    /// least. The uncertain numbers of the nominal are fitted in each, within bounds.
    pub(crate) fn explained(&self, set: usize, without: &[usize]) -> f64 {
        let whole = self.found(set);
        let log = |level: &Level, out: &[usize]| {
            let found = self.search(level).without(whole, out)?;
            level.at_best(self.problem, &found, self.choices.bounds(&found.columns))
        };
        let Some(least) = self.predictions.first() else {
            return 0.0;
        };
        let levels = self.predictions.iter();
        let best = levels.flat_map(|level| [log(level, &[]), log(level, &whole.set)]);
        let best = best.flatten().fold(f64::NEG_INFINITY, f64::max);
        let (some, nothing) = (log(least, without), log(least, &whole.set));
        some.zip(nothing).map_or(0.0, |(some, nothing)| {
            let lost = (best - nothing).max(f64::MIN_POSITIVE);
            ((some - nothing) / lost).clamp(0.0, 1.0)
        })
    }

    /// Probabilities of no effect: that simulation and measurement agree, and that something is missing that no effect models:
    /// forces, or slow errors of sensors that are more than their own.
    pub(crate) fn without_effects(&self) -> (f64, f64) {
        let options = &self.problem.settings.options;
        let is_gap = |of: &Found| self.levels[of.level].is_gap(&options.likelihood);
        let (large, small): (Vec<&Found>, Vec<&Found>) = (self.found.iter())
            .filter(|of| of.set.is_empty())
            .partition(|of| is_gap(of));
        let small_log = small.iter().map(|of| of.log_likelihood);
        let small_log = small_log.fold(f64::NEG_INFINITY, f64::max);
        // Disturbances count as seen where they are not negligible and the trials so much likelier with them.
        let seen = -options.name.error.ln();
        let (mut agreement, mut unmodelled) = (0.0, 0.0);
        for found in small {
            agreement += self.probability(found);
        }
        for found in large {
            if found.log_likelihood - small_log > seen {
                unmodelled += self.probability(found);
            } else {
                agreement += self.probability(found);
            }
        }
        (agreement, unmodelled)
    }

    /// Log odds of any gap but effects with values of each trial's own, and the odds of these; each against agreement.
    pub(crate) fn odds(&self) -> (f64, f64) {
        let (agreement, _) = self.without_effects();
        let own = self.found.iter().filter(|of| !of.own.is_empty());
        // Not `sum`: of nothing it is the negative zero, whose reciprocal is below all.
        let own = own.map(|of| self.probability(of)).fold(0.0, |a, b| a + b);
        let against = agreement.max(f64::MIN_POSITIVE);
        let common = (1.0 - agreement - own).max(0.0);
        ((common / against).ln(), own / against)
    }

    /// Likeliest sets, and log odds of any effect against none, that the search finds in simulated trials in which a set is
    /// true, its values drawn from their posterior.
    pub(crate) fn simulated(
        &self,
        set: usize,
        largest: usize,
        draws: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<(Vec<usize>, f64)> {
        let mechanisms = mechanisms(self.problem, &self.sets[set].set);
        let of_set = self.found.iter().filter(|of| {
            self.levels[of.level].is_searched
                && self::mechanisms(self.problem, &of.set) == mechanisms
        });
        let Some(found) = likeliest(of_set) else {
            return Vec::new();
        };
        let Some(simulator) = self.levels[found.level].simulator(found) else {
            return Vec::new();
        };
        let choices = self.choices.up_to(largest);
        let levels: Vec<Level> = (0..draws).map(|_| simulator.draw(rng)).collect();
        levels
            .par_iter()
            .map(|level| {
                let choices = &choices;
                let all = Search { level, choices }.run();
                let nothing = all.iter().find(|of| of.set.is_empty());
                let nothing = nothing.map_or(f64::NEG_INFINITY, |of| of.log_posterior);
                let some = all.iter().filter(|of| !of.set.is_empty());
                let odds = log_sum(some.map(|of| of.log_posterior)) - nothing;
                let best = likeliest(&all).map_or_else(Vec::new, |of| of.set.clone());
                (best, odds)
            })
            .collect()
    }
}

/// Sets by effects and targets, the likeliest first.
fn posterior(problem: &Problem<'_>, found: &[Found], log_total: f64) -> Vec<SetPosterior> {
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
                probability: (whole - log_total).exp(),
            })
        })
        .collect();
    sets.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    sets
}

/// Effects and targets of a set, whatever the forms of its candidates.
fn mechanisms<'b>(problem: &'b Problem<'_>, set: &[usize]) -> Vec<(Id, &'b [String])> {
    let of = |at: &usize| problem.candidates[*at].mechanisms();
    let mut mechanisms: Vec<_> = set.iter().flat_map(of).collect();
    mechanisms.sort_unstable();
    mechanisms
}
