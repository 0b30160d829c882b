//! Which sets of effects explain the trials: sweep, search, and again about the best set until it stays.
//!
//! Far from the point of a sweep first order misleads. So a set counts as it is about itself, once the point has been there;
//! and the point only goes where the set is likelier there than the best so far.
//!
//! The first and the last look are along all candidates, and so is the one from a best set that another did not improve. Those between
//! are along the ones that stood in a set near the best of a look: the cost of a sweep grows with the square of the directions, and most
//! candidates never come near.

use std::collections::BTreeSet;

use crate::{
    error::GapError,
    likelihood::{
        choices::Choices,
        directions::Direction,
        edge::Edge,
        explanation::Explanation,
        followed::{Followed, diverges},
        found::{Found, likeliest},
        level::{Level, Sizes},
        search::Search,
        seen::{Seen, loses_too},
        working_point::{Keep, WorkingPoint},
    },
    options::LikelihoodOptions,
    problem::{point::Point, problem::Problem},
    progress::Watch,
};

/// Halvings of the values on which a trial blows up, at most.
const HALVINGS: usize = 5;

/// The likeliest sets of effects with plausible values, where they explain the trials as well as others do, or nearly; or else the
/// likeliest.
///
/// # Errors
/// The nominal diverges on some trial, or a stop was asked for.
pub fn explain<'p>(
    followed: &'p Followed<'p>,
    watch: &Watch<'_>,
) -> Result<Explanation<'p>, GapError> {
    let likeliest = explain_without(followed, watch, BTreeSet::new())?;
    let edges = implausible(&likeliest);
    if edges.is_empty() {
        return Ok(likeliest);
    }
    let left_out = edges.iter().map(|of| of.candidate).collect();
    let mut without = explain_without(followed, watch, left_out)?;
    let least = followed.problem.settings.options.name.plausible;
    let is_enough = |best| without.edges(best).is_empty() && without.explained(best, &[]) >= least;
    if !without.best().is_some_and(is_enough) {
        return Ok(likeliest);
    }
    without.left_out = edges;
    Ok(without)
}

/// Values at the end of what is plausible of the likeliest set; none where nothing is likelier, or where they are of an effect that
/// is expected and cannot be left out.
fn implausible(explanation: &Explanation<'_>) -> Vec<Edge> {
    let nothing = explanation.nothing();
    let best = explanation.best().filter(|best| *best < nothing);
    let edges = best.map_or_else(Vec::new, |best| explanation.edges(best));
    let is_expected = |of: &Edge| explanation.problem.priors[of.candidate].is_expected;
    match edges.iter().any(is_expected) {
        true => Vec::new(),
        false => edges,
    }
}

/// Sweeps, searches and moves the working point until the best set stays; some candidates left out.
fn explain_without<'p>(
    followed: &'p Followed<'p>,
    watch: &Watch<'_>,
    left_out: BTreeSet<usize>,
) -> Result<Explanation<'p>, GapError> {
    let problem = followed.problem;
    let mut working = followed.working_point(watch);
    working.left_out = left_out;
    // Without a set only starts and forces may explain the gap, or the numbers would run to their bounds for it.
    let Some(mut best) = look(problem, &mut working, None, &How::Unsettled)? else {
        return Err(diverges(problem));
    };
    let none = best.without_effects();
    working.without_effects = Some(none);
    let heeded = best.choices.of.keys().copied();
    let expected = heeded.filter(|of| problem.priors[*of].is_expected);
    let mut seen = Seen::beside(expected.collect());
    // No effect with the numbers refitted: what effects, refitted too, have to be likelier than.
    let mut alone = refitted(working.clone())?;
    seen.learn(&[], alone.as_ref().map_or(best.own(), |of| of.1));
    seen.keep(&best.found);
    let mut expected = best.expected();
    let mut failed = false;
    let rounds = problem.settings.options.likelihood.rounds;
    let doing = match working.left_out.is_empty() {
        true => "weighing sets of effects",
        false => "weighing sets of plausible values",
    };
    let options = &problem.settings.options.likelihood;
    let mut added = options.added;
    // Sets that could not follow, and what they came to: of no weight where one with more can.
    let mut parts: Vec<(Vec<usize>, f64)> = Vec::new();
    for round in 0..rounds {
        (watch.tell)(doing, round, rounds);
        best.correct(&seen);
        let step = expected.take().or_else(|| best.promising(added));
        let is_rival = step.is_none();
        // Where few candidates lead no further, one that was left out may.
        if (is_rival || failed) && !best.is_whole {
            best = best.along_all(problem, &mut working, none)?;
            seen.keep(&best.found);
            failed = false;
            continue;
        }
        let rival = || {
            let unseen = best.rival(&seen).or_else(|| best.part(&seen));
            unseen.or_else(|| best.lagging(&seen))
        };
        let Some(next) = step.or_else(rival) else {
            break;
        };
        seen.go(best.point.set(), &next.set);
        let before = working.clone();
        let is_same = next.set == best.point.set();
        let leader = seen.log(&best.point.set());
        let behind = problem.settings.options.likelihood.far_behind;
        let least = (!is_same).then_some(leader - behind);
        let worth = seen.worth(problem.settings.options.likelihood.worth_within);
        let how = How::Some(&worth);
        best.go(&mut working, &next);
        let settled = alone.take_if(|_| next.set.is_empty());
        let looked = look_from(problem, (&mut working, settled), none, &how, least)?;
        let (there, own) = match looked {
            Looked::There(there) => {
                seen.keep(&there.found);
                let own = there.own();
                (Some(*there), own)
            }
            Looked::Behind(own) => (None, own),
        };
        let is_better = is_same || own > leader;
        // What is missing may be too much for a part of it alone to follow: friction that stands for damping holds a joint fast.
        let may_have_more = there.is_none() && !is_rival && !is_same;
        if may_have_more && best.is_part_of_more(&next, options.far_behind) {
            working = before;
            added += 1;
            parts.push((next.set, own));
            continue;
        }
        added = options.added;
        if is_better {
            parts.clear();
        }
        (parts.drain(..)).for_each(|(set, own)| seen.learn(&set, own));
        seen.learn(&next.set, own);
        failed = !is_better;
        match there.filter(|_| is_better) {
            Some(there) => best = there,
            None => {
                working = before;
                if is_rival {
                    continue;
                }
                let settled = match best.settled {
                    true => None,
                    // Numbers that are not refitted favour whatever stands for them.
                    false => {
                        let worth = seen.worth(problem.settings.options.likelihood.worth_within);
                        let how = How::Some(&worth);
                        let settled = alone.take_if(|_| best.point.set().is_empty());
                        match look_from(problem, (&mut working, settled), none, &how, None)? {
                            Looked::There(there) => Some(*there),
                            Looked::Behind(_) => None,
                        }
                    }
                };
                match settled {
                    Some(settled) => best = settled,
                    None => {
                        best.search_without(&next.set, &problem.settings.options.likelihood);
                        best.settled |= is_same;
                    }
                }
            }
        }
    }
    if !best.is_whole {
        best = best.along_all(problem, &mut working, none)?;
    }
    (parts.drain(..)).for_each(|(set, own)| seen.learn(&set, own));
    best.correct(&seen);
    let predictions = match best.found.first() {
        Some(found) => {
            let sizes = best.levels[found.level].sizes;
            working.predictions(&best.directions, sizes)?
        }
        None => Vec::new(),
    };
    Ok(best.explanation(followed, predictions))
}

/// The empty set with the numbers of the nominal refitted, and its log posterior; `None` where a trial blows up.
fn refitted<'p, 'a>(
    mut alone: WorkingPoint<'p, 'a>,
) -> Result<Option<(WorkingPoint<'p, 'a>, f64)>, GapError> {
    let log = alone.settled_posterior(None)?;
    Ok(log.map(|log| (alone, log)))
}

/// One sweep about a point, and what was found from there.
struct Look<'p> {
    point: Point,
    /// True where the point's values are not fitted again.
    settled: bool,
    /// True where the point's set counts by what the point has reached.
    counts_as_reached: bool,
    /// True where it was along all candidates.
    is_whole: bool,
    directions: Vec<Direction>,
    choices: Choices<'p>,
    levels: Vec<Level>,
    /// As first order has it from here, but for sets about which there was a sweep; the likeliest first.
    found: Vec<Found>,
}

/// A look, or where its set is far behind.
enum Looked<'p> {
    There(Box<Look<'p>>),
    /// Log posterior of the set, far behind what was asked for; none has a set with which a trial blows up.
    Behind(f64),
}

impl<'p> Looked<'p> {
    const NOWHERE: Self = Self::Behind(f64::NEG_INFINITY);

    fn there(look: Look<'p>) -> Self {
        Self::There(Box::new(look))
    }
}

/// The candidates along which a look is.
enum How<'w> {
    /// All, from a point whose values have not settled.
    Unsettled,
    /// All, from one whose values have.
    All,
    /// These alone, from such a one.
    Some(&'w BTreeSet<usize>),
}

/// Lets a point settle and looks from there, unless its set is less likely than `least`; `none`: log likelihood without effects.
fn look_if<'p>(
    problem: &'p Problem<'p>,
    working: &mut WorkingPoint<'_, '_>,
    none: f64,
    how: &How<'_>,
    least: Option<f64>,
) -> Result<Looked<'p>, GapError> {
    for _ in 0..HALVINGS {
        if working.follow()?
            && let Some(own) = working.settled_posterior(least)?
        {
            if least.is_some_and(|least| own < least) {
                return Ok(Looked::Behind(own));
            }
            if let Some(there) = look(problem, working, Some(none), how)? {
                return Ok(Looked::there(there));
            }
        }
        working.halve();
    }
    Ok(Looked::NOWHERE)
}

/// Looks from where the point's set has `settled` already, or lets it settle first ([`look_if`]).
fn look_from<'p, 'w, 'a>(
    problem: &'p Problem<'p>,
    (working, settled): (
        &mut WorkingPoint<'w, 'a>,
        Option<(WorkingPoint<'w, 'a>, f64)>,
    ),
    none: f64,
    how: &How<'_>,
    least: Option<f64>,
) -> Result<Looked<'p>, GapError> {
    let Some((settled, _)) = settled else {
        return look_if(problem, working, none, how, least);
    };
    *working = settled;
    let there = look(problem, working, Some(none), how)?;
    Ok(there.map_or(Looked::NOWHERE, Looked::there))
}

/// Looks from a point; `none`: log likelihood without effects, where it is known. `None` where a trial blows up.
fn look<'p>(
    problem: &'p Problem<'p>,
    working: &mut WorkingPoint<'_, '_>,
    none: Option<f64>,
    how: &How<'_>,
) -> Result<Option<Look<'p>>, GapError> {
    let is_along = |candidate: &usize| match how {
        How::Unsettled | How::All => true,
        How::Some(worth) => worth.contains(candidate),
    };
    let directions: Vec<Direction> = (0..problem.candidates.len())
        .filter(|candidate| !working.point.candidates.contains(candidate))
        .filter(|candidate| !working.left_out.contains(candidate))
        .filter(is_along)
        .flat_map(|candidate| problem.directions(candidate))
        .collect();
    let swept = working.sweep(Some(&directions), Keep::Likelihood, None)?;
    let Some(swept) = swept.filter(|swept| !swept.levels.is_empty()) else {
        return Ok(None);
    };
    let levels = swept.levels;
    let mut choices = Choices::new(problem, &working.point, &directions);
    choices.heed(&levels, &working.point.candidates);
    let none = none.unwrap_or_else(|| without_effects(&levels, &choices));
    let choices = choices.against_none(none);
    let mut look = Look {
        point: working.point.clone(),
        settled: !matches!(how, How::Unsettled),
        counts_as_reached: working.counts_as_reached,
        is_whole: !matches!(how, How::Some(_)),
        directions,
        choices,
        levels,
        found: Vec::new(),
    };
    look.search(&problem.settings.options.likelihood);
    Ok(Some(look))
}

/// Log likelihood without effects beside the disturbances that make it likeliest.
fn without_effects(levels: &[Level], choices: &Choices<'_>) -> f64 {
    let none = levels
        .iter()
        .filter_map(|level| Some(Search { level, choices }.whole(&[])?.log_likelihood));
    none.fold(f64::NEG_INFINITY, f64::max)
}

impl<'p> Look<'p> {
    fn without_effects(&self) -> f64 {
        without_effects(&self.levels, &self.choices)
    }

    /// Log posterior of the point's own set.
    fn own(&self) -> f64 {
        let set = self.point.set();
        let own = self.found.iter().filter(|of| of.set == set);
        own.map(|of| of.log_posterior)
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// The same look along all candidates; as it is where a trial blows up.
    fn along_all(
        mut self,
        problem: &'p Problem<'p>,
        working: &mut WorkingPoint<'_, '_>,
        none: f64,
    ) -> Result<Self, GapError> {
        self.is_whole = true;
        let all = look(problem, working, Some(none), &How::All)?;
        Ok(all.unwrap_or(self))
    }

    fn search(&mut self, options: &LikelihoodOptions) {
        self.found = search(&self.levels, &self.choices, options);
        if let Some(best) = likeliest(&self.found) {
            let subsets = subsets(&self.levels[best.level], &self.choices, best);
            self.found
                .retain(|of| !subsets.iter().any(|other| other.is(of)));
            self.found.extend(subsets);
        }
        // The point's own set, wherever the search went.
        let own = self.point.set();
        for level in self.levels.iter().filter(|of| of.is_searched) {
            let is_it = |of: &Found| of.level == level.number && of.set == own;
            if !self.found.iter().any(is_it) {
                let choices = &self.choices;
                (self.found).extend(Search { level, choices }.whole(&self.point.candidates));
            }
        }
        if self.counts_as_reached {
            self.keep_to_what_was_reached(&own);
        }
        self.sort();
    }

    /// Takes what first order promises the point's set beyond what the point has reached from it, and from all sets that hold it.
    fn keep_to_what_was_reached(&mut self, own: &[usize]) {
        let (problem, point) = (self.choices.problem, &self.point);
        let promised: Vec<(usize, f64)> = (self.found.iter())
            .filter(|of| of.set == own)
            .map(|of| {
                let level = &self.levels[of.level];
                (of.level, level.promised(problem, point, of))
            })
            .collect();
        for of in &mut self.found {
            let holds = own.iter().all(|member| of.set.contains(member));
            let lost = promised.iter().find(|(level, _)| *level == of.level);
            if let Some((_, nats)) = lost.filter(|_| holds) {
                of.log_likelihood -= nats;
                of.log_posterior -= nats;
            }
        }
    }

    fn sort(&mut self) {
        (self.found).sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    }

    /// Searches again without the effect by which a set that did not survive its own sweep differs from the point's, where it is
    /// one.
    fn search_without(&mut self, set: &[usize], options: &LikelihoodOptions) {
        let own = self.point.set();
        let added: Vec<usize> = set.iter().copied().filter(|of| !own.contains(of)).collect();
        if let [one] = added[..] {
            let had = std::mem::take(&mut self.found);
            self.choices.leave_out(one);
            self.search(options);
            let lost = had.into_iter().filter(|of| of.set.contains(&one));
            self.found.extend(lost);
            self.sort();
        }
    }

    /// Gives sets about which there was a sweep the log posterior that they had there. What such a set lost others are taken to have
    /// lost too ([`loses_too`]).
    fn correct(&mut self, seen: &Seen) {
        let own = self.point.set();
        let here = |set: &[usize]| {
            let of_set = self.found.iter().filter(|of| of.set == *set);
            of_set
                .map(|of| of.log_posterior)
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let losses: Vec<(&[usize], f64)> = (seen.about())
            .filter(|(set, _)| *set != own || set.is_empty())
            .map(|(set, there)| (set, here(set) - there))
            .filter(|(_, loss)| loss.is_finite() || *loss > 0.0)
            .collect();
        for of in &mut self.found {
            let exact = losses.iter().find(|(set, _)| *set == of.set);
            let within = losses
                .iter()
                .filter(|(set, _)| loses_too(&own, set, &of.set));
            let loss = match exact {
                Some((_, loss)) => *loss,
                None => within.map(|of| of.1).fold(0.0, f64::max),
            };
            of.log_likelihood -= loss;
            of.log_posterior -= loss;
        }
        self.sort();
    }

    /// The set of all expected effects, where there are any.
    fn expected(&self) -> Option<Found> {
        let expected = self.choices.expected();
        let of_set = self.found.iter().filter(|of| of.set == expected);
        likeliest(of_set).filter(|_| !expected.is_empty()).cloned()
    }

    /// The set to go to: the best, few effects more at a time, for the errors of form of more would be taken for others. `None`
    /// where it is the point's own and settled.
    fn promising(&self, added: usize) -> Option<Found> {
        let set = self.point.set();
        let most = self.unexpected(&set).count() + added;
        let best = (self.found.iter()).find(|of| self.unexpected(&of.set).count() <= most)?;
        (best.set != set || !self.settled).then(|| best.clone())
    }

    /// Candidates of a set that are not expected.
    fn unexpected<'s>(&'s self, set: &'s [usize]) -> impl Iterator<Item = &'s usize> {
        let priors = &self.choices.problem.priors;
        set.iter().filter(|of| !priors[**of].is_expected)
    }

    /// True where a set that has one effect more than another, and all of its, is likelier by so much.
    fn is_part_of_more(&self, part: &Found, by: f64) -> bool {
        let larger = self.found.iter().filter(|of| {
            self.unexpected(&of.set).count() == self.unexpected(&part.set).count() + 1
                && part.set.iter().all(|member| of.set.contains(member))
        });
        likeliest(larger).is_some_and(|of| of.log_posterior > part.log_posterior + by)
    }

    /// The set about which there was no sweep and which may be as likely as the best, as it is from here.
    fn rival(&self, seen: &Seen) -> Option<Found> {
        let set = seen.rival(self.choices.options())?;
        self.whole(set)
    }

    /// The point's set without one of its members, about which there was no sweep: first order misleads where the other members
    /// have taken its part.
    fn part(&self, seen: &Seen) -> Option<Found> {
        let set = self.point.set();
        let mut parts = self.unexpected(&set).map(|out| -> Vec<usize> {
            let kept = set.iter().copied().filter(|of| of != out);
            kept.collect()
        });
        let part = parts.find(|part| !seen.is_known(part))?;
        self.whole(&part)
    }

    /// A set that is likelier to first order from here than it was about itself: its values settled in a lesser place, so that
    /// even effects that do nothing seem to gain over it.
    fn lagging(&self, seen: &Seen) -> Option<Found> {
        let set = self.point.set();
        let options = self.choices.options();
        let here = |set: &[usize]| self.first_order(set);
        seen.lagging(&set, here, [options.far_behind, options.lagging])
    }

    /// A set as it is from here, sweeps about it included.
    fn whole(&self, set: &[usize]) -> Option<Found> {
        let found = self.found.iter().filter(|of| of.set == set);
        likeliest(found).cloned().or_else(|| self.first_order(set))
    }

    /// A set as first order has it from here; `None` of one that holds what the look was not along.
    fn first_order(&self, set: &[usize]) -> Option<Found> {
        let choices = &self.choices;
        if !set.iter().all(|of| choices.of.contains_key(of)) {
            return None;
        }
        let levels = self.levels.iter().filter(|of| of.is_searched);
        let found = levels.filter_map(|level| Search { level, choices }.whole(set));
        likeliest(&found.collect::<Vec<Found>>()).cloned()
    }

    /// Moves the working point to a set, and its levels to where sets are likely.
    fn go(&self, working: &mut WorkingPoint<'_, '_>, next: &Found) {
        let level = &self.levels[next.level];
        let problem = working.problem;
        working.point = level.moved(problem, &self.point, &self.directions, next).0;
        // Where nothing is likeliest so far, effects may be likelier at any level.
        if !next.set.is_empty() {
            let logs =
                (self.found.iter()).map(|of| (self.levels[of.level].sizes, of.log_posterior));
            working.search_about(level.sizes, &logs.collect::<Vec<(Sizes, f64)>>());
        }
    }

    fn explanation(self, followed: &'p Followed<'p>, predictions: Vec<Level>) -> Explanation<'p> {
        Explanation::new(
            followed,
            self.point,
            self.directions,
            self.choices,
            (self.levels, predictions),
            self.found,
        )
    }
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
