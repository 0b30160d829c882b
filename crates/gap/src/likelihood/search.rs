//! The search over sets of effects on the Gram matrices of the filter.

use std::{collections::BTreeSet, sync::Arc};

use nalgebra::DVector;
use rayon::prelude::*;

use crate::likelihood::{
    by_trial::Own,
    choices::Choices,
    found::{Found, Held, Member, likeliest},
    given::Given,
    held,
    level::Level,
    quadratic::Quadratic,
    truncated_evidence::{self, Truncated},
    truncated_normal::Bounds,
};

/// A level with the choices of all candidates.
pub(crate) struct Search<'a> {
    pub(crate) level: &'a Level,
    pub(crate) choices: &'a Choices<'a>,
}

impl Search<'_> {
    /// The empty set, and every set on the way to the best.
    pub(crate) fn run(&self) -> Vec<Found> {
        let Some(empty) = self.whole(&[]) else {
            return Vec::new();
        };
        let mut all = vec![empty.clone()];
        let mut seen: BTreeSet<Vec<usize>> = BTreeSet::from([Vec::new()]);
        let mut front = vec![empty];
        // One effect may stand for several expected ones, so that the way to all of them leads over worse sets.
        let expected = self.choices.expected();
        if self.choices.largest >= expected.len() && seen.insert(expected.clone()) {
            front.extend(self.whole(&expected));
            all.extend(front.iter().skip(1).cloned());
        }
        let options = self.choices.options();
        for _ in 0..self.choices.largest {
            let mut next = Vec::new();
            for set in &front {
                for candidate in self.additions(set).into_iter().take(options.evaluated) {
                    if seen.insert(with(&set.set, candidate))
                        && let Some(found) = self.full(set, Some(candidate), None)
                    {
                        next.push(found);
                    }
                }
            }
            let descending = |a: &Found, b: &Found| b.log_posterior.total_cmp(&a.log_posterior);
            next.sort_by(descending);
            for found in next.iter_mut().take(options.beam) {
                if let Some(polished) = self.polished(found) {
                    *found = polished;
                }
            }
            next.sort_by(descending);
            let best_so_far = likeliest(&all).map_or(f64::NEG_INFINITY, |of| of.log_posterior);
            let improved = (next.first())
                .is_some_and(|of| of.log_posterior > best_so_far - options.enlarged_within);
            all.extend(next.iter().cloned());
            front = next;
            front.truncate(options.beam);
            if !improved {
                break;
            }
        }
        if self.choices.largest > 1 {
            self.refine(&mut all, &mut seen);
        }
        all
    }

    /// Removals from and exchanges in the best set, as long as they help.
    fn refine(&self, all: &mut Vec<Found>, seen: &mut BTreeSet<Vec<usize>>) {
        for _ in 0..self.choices.largest {
            let Some(best) = likeliest(&*all).cloned() else {
                return;
            };
            let mut found = Vec::new();
            for out in &best.set {
                let rest: Vec<usize> = best.set.iter().copied().filter(|of| of != out).collect();
                let Some(without) = self.full(&best, None, Some(*out)) else {
                    continue;
                };
                if seen.insert(rest) {
                    found.push(without.clone());
                }
                for candidate in self
                    .additions(&without)
                    .into_iter()
                    .filter(|of| of != out)
                    .take(self.choices.options().evaluated)
                {
                    if seen.insert(with(&without.set, candidate)) {
                        found.extend(self.full(&without, Some(candidate), None));
                    }
                }
            }
            let better = found.iter().any(|of| of.log_posterior > best.log_posterior);
            all.extend(found);
            if !better {
                return;
            }
        }
    }

    fn found(&self, members: Vec<Member>, mixtures: Vec<f64>, of: Evaluated) -> Found {
        let set: Vec<usize> = members.iter().map(|of| of.0).collect();
        let log_likelihood = of.log_likelihood() + mixtures.iter().sum::<f64>();
        Found {
            log_likelihood,
            log_posterior: log_likelihood
                + self.choices.log_odds(&set, log_likelihood)
                + self.choices.log_form_odds(&members, log_likelihood)
                + (self.level).log_prior(!set.is_empty(), self.choices.options()),
            set,
            level: self.level.number,
            members,
            columns: of.columns,
            own: of.own,
            held: of.held,
            mixtures,
            posterior: of.posterior,
        }
    }

    /// Candidates that may be added to a set, by their posterior to first order, the best first.
    fn additions(&self, set: &Found) -> Vec<usize> {
        let options = self.choices.options();
        let Some(given) = self.given(set) else {
            return Vec::new();
        };
        let mut promising: Vec<(f64, usize, Vec<Quadratic>)> = self
            .choices
            .beside(&set.set)
            .filter_map(|candidate| {
                let choices = self.choices.of[&candidate].iter();
                let quadratics: Vec<Quadratic> = choices
                    .map(|columns| set.conditional(&given.quadratic, columns))
                    .collect();
                // An effect that leaves no trace in the data is not told from none.
                let leaves_trace =
                    (quadratics.iter()).any(|of| of.information() > options.least_information);
                let gains = quadratics.iter().map(Quadratic::most_gain);
                let gain = gains.fold(0.0, f64::max);
                leaves_trace.then_some((gain, candidate, quadratics))
            })
            .collect();
        promising.sort_by(|a, b| b.0.total_cmp(&a.0));
        promising.truncate(options.screened);
        let mut found: Vec<(usize, f64)> = promising
            .par_iter()
            .filter_map(|(_, candidate, quadratics)| {
                let mut logs = Vec::new();
                for (columns, of) in self.choices.of[candidate].iter().zip(quadratics) {
                    for scale in 0..options.prior_scales.len() {
                        let (sd, bounds) = self.prior(columns, scale);
                        let evidence = truncated_evidence::evidence(&of.a, &of.b, &sd, &bounds);
                        logs.extend(evidence.map(|of| of.log_evidence));
                    }
                }
                if logs.is_empty() {
                    return None;
                }
                let mean = log_sum(logs.iter().copied()) - (logs.len() as f64).ln();
                Some((*candidate, mean))
            })
            .collect();
        found.extend(self.by_trial(set));
        for (candidate, log) in &mut found {
            let larger = with(&set.set, *candidate);
            *log += self.choices.log_odds(&larger, set.log_likelihood + *log);
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut seen = BTreeSet::new();
        let found = found.into_iter().map(|(candidate, _)| candidate);
        found.filter(|candidate| seen.insert(*candidate)).collect()
    }

    /// True where the likelihood of each trial is known, of several, and of all columns.
    pub(super) fn has_trials(&self) -> bool {
        self.level.is_searched && self.level.trials.len() > 1
    }

    /// The likelihood of all columns beside a found set's uncertain numbers, some of them held, and values of each trial's own.
    fn given(&self, set: &Found) -> Option<Arc<Given>> {
        if set.own.is_empty() && set.held.is_empty() {
            return self.level.given(&set.set);
        }
        let all: Vec<usize> = (0..self.choices.columns.len()).collect();
        let beside = (&set.own, &set.held);
        Some(Arc::new(self.level.given_held(&set.set, beside, &all)?))
    }

    /// Columns that the scale mixture touches.
    pub(super) fn amplitudes(&self, columns: &[usize]) -> Vec<usize> {
        let all = columns.iter().copied();
        all.filter(|column| !self.choices.columns[*column].shapes)
            .collect()
    }

    pub(super) fn prior(&self, columns: &[usize], scale: usize) -> (DVector<f64>, Vec<Bounds>) {
        let of = |column: &usize| &self.choices.columns[*column];
        let sd = columns.iter().map(|column| {
            if of(column).shapes {
                1.0
            } else {
                self.choices.options().prior_scales[scale]
            }
        });
        (
            DVector::from_iterator(columns.len(), sd),
            columns.iter().map(|column| of(column).bounds).collect(),
        )
    }

    /// A set evaluated in full, from a set with a candidate added, over all its scales and choices, or one taken out.
    fn full(&self, from: &Found, added: Option<usize>, out: Option<usize>) -> Option<Found> {
        let mut members = from.kept(out.as_slice());
        members.extend(added.map(|candidate| (self.untried(candidate), 0.0)));
        // What takes the place of one that left may be of any size.
        self.ascend(members, &from.held, |candidate| {
            out.is_some() || Some(candidate) == added
        })
        .filter(|found| self.is_resolved(found))
    }

    /// A found set, over all scales and choices of each member in turn.
    fn polished(&self, found: &Found) -> Option<Found> {
        let members = found.members.iter().map(|of| (*of, 0.0)).collect();
        self.ascend(members, &found.held, |_| true)
            .filter(|found| self.is_resolved(found))
    }

    /// False where a sensor's delay is shorter than a step: when within a step it reads explains as much.
    fn is_resolved(&self, found: &Found) -> bool {
        let mut first = 0;
        found.members.iter().all(|(candidate, choice, ..)| {
            let least = self.choices.least(*candidate);
            let is_short = least.is_some_and(|least| found.posterior.mean[first].abs() < least);
            first += self.choices.of[candidate][*choice].len();
            !is_short
        })
    }

    /// A member before its choices and scales are tried: the first choice, the middle scale.
    fn untried(&self, candidate: usize) -> Member {
        let middle = self.choices.options().prior_scales.len() / 2;
        (candidate, 0, middle, None)
    }

    /// Choices and scales of a member with the logarithms of their prior shares, values of each trial's own last where it is said
    /// that it differs.
    fn ways(&self, candidate: usize, is_differing: bool) -> Vec<(Member, f64)> {
        let options = self.choices.options();
        let count = options.prior_scales.len();
        let choices = 0..self.choices.of[&candidate].len();
        let each = choices.flat_map(|choice| (0..count).map(move |scale| (choice, scale)));
        let each: Vec<(usize, usize)> = each.collect();
        let differs = match self.has_trials() && self.choices.may_differ(candidate) {
            true => options.differs,
            false => 0.0,
        };
        let common = ((1.0 - differs) / each.len() as f64).ln();
        let mut ways: Vec<(Member, f64)> = (each.iter())
            .map(|(choice, scale)| ((candidate, *choice, *scale, None), common))
            .collect();
        if differs > 0.0 && is_differing {
            let sizes = options.own_sizes.len();
            let own = (differs / (each.len() * sizes) as f64).ln();
            ways.extend(each.iter().flat_map(|(choice, scale)| {
                (0..sizes).map(move |size| ((candidate, *choice, *scale, Some(size)), own))
            }));
        }
        ways
    }

    /// The set of all candidates of the point.
    pub(crate) fn whole(&self, candidates: &[usize]) -> Option<Found> {
        let members = candidates.iter().map(|of| (self.untried(*of), 0.0));
        self.ascend(members.collect(), &Held::new(), |_| true)
    }

    /// The likeliest choices and scales of some members, one member after the other; values of each trial's own for those that
    /// have them, and where they are likelier to first order than a common one.
    fn ascend(
        &self,
        members: Vec<(Member, f64)>,
        held: &Held,
        varied: impl Fn(usize) -> bool,
    ) -> Option<Found> {
        let own = members.iter().filter(|(of, _)| of.3.is_some());
        let own: Vec<usize> = own.map(|(of, _)| of.0).collect();
        let found = self.climb(members, held, &varied, &own)?;
        let mut differing = self.differing(&found, &varied);
        if differing.is_empty() {
            return Some(found);
        }
        differing.extend(own);
        self.climb(found.kept(&[]), &found.held, &varied, &differing)
    }

    fn climb(
        &self,
        mut members: Vec<(Member, f64)>,
        held: &Held,
        varied: &impl Fn(usize) -> bool,
        differing: &[usize],
    ) -> Option<Found> {
        members.sort_by_key(|(of, _)| *of);
        let plain = |members: &[(Member, f64)]| -> Vec<Member> {
            members.iter().map(|(of, _)| *of).collect()
        };
        let mut best = self.evaluate(&plain(&members), held);
        for at in 0..members.len() {
            let candidate = members[at].0.0;
            if !varied(candidate) {
                continue;
            }
            let mut logs = Vec::new();
            let mut likeliest = f64::NEG_INFINITY;
            let held = best.as_ref().map_or(held, |of| &of.held).clone();
            for (way, log_share) in self.ways(candidate, differing.contains(&candidate)) {
                let mut tried = plain(&members);
                tried[at] = way;
                let Some(found) = self.evaluate(&tried, &held) else {
                    continue;
                };
                let log = found.log_likelihood() + log_share;
                logs.push(log);
                if log >= likeliest {
                    likeliest = log;
                    members[at].0 = way;
                    best = Some(found);
                }
            }
            members[at].1 = log_sum(logs.iter().copied()) - best.as_ref()?.log_likelihood();
        }
        let (members, mixtures) = members.into_iter().unzip();
        Some(self.found(members, mixtures, best?))
    }

    /// Precision of the priors of a set's columns.
    pub(crate) fn precision(&self, members: &[Member]) -> Vec<f64> {
        let of = |(candidate, choice, scale, _): &Member| {
            let (sd, _) = self.prior(&self.choices.of[candidate][*choice], *scale);
            sd.map(|sd| sd.powi(-2)).as_slice().to_vec()
        };
        members.iter().flat_map(of).collect()
    }

    /// A found set without some of its candidates, choices and scales as they were found.
    pub(crate) fn without(&self, found: &Found, out: &[usize]) -> Option<Found> {
        self.ascend(found.kept(out), &found.held, |_| false)
    }

    /// A found set on this level's likelihood, its choices and scales as they were found.
    pub(crate) fn again(&self, found: &Found) -> Option<Found> {
        let (members, mixtures) = (found.members.clone(), found.mixtures.clone());
        let evaluated = self.evaluate(&members, &found.held)?;
        Some(self.found(members, mixtures, evaluated))
    }

    /// The members' likelihood and posterior; `held`: what stands beside them and is likely to be at a bound.
    fn evaluate(&self, members: &[Member], held: &Held) -> Option<Evaluated> {
        let mut columns = Vec::new();
        let mut own_columns = Own::new();
        let mut sds = Vec::new();
        let mut bounds = Vec::new();
        for (candidate, choice, scale, size) in members {
            let own = &self.choices.of[candidate][*choice];
            let (sd, within) = self.prior(own, *scale);
            if let Some(size) = size {
                let size = self.choices.options().own_sizes[*size];
                let amplitudes = own.iter().zip(&sd);
                let amplitudes = amplitudes.filter(|(at, _)| !self.choices.columns[**at].shapes);
                own_columns.extend(amplitudes.map(|(at, sd)| (*at, size * sd)));
            }
            columns.extend(own);
            sds.extend(sd.iter().copied());
            bounds.extend(within);
        }
        let set: Vec<usize> = members.iter().map(|of| of.0).collect();
        let sd = DVector::from_vec(sds);
        let precision: Vec<f64> = sd.iter().map(|sd| sd.powi(-2)).collect();
        let beside = held::OfSet {
            set: &set,
            own: &own_columns,
            columns: &columns,
            precision: &precision,
            most: self.choices.options().largest_shift,
        };
        let mut held = held.clone();
        let (given, posterior, cut) = held::bounded(self.level, &beside, &mut held, |of| {
            truncated_evidence::evidence(&of.a, &of.b, &sd, &bounds)
        })?;
        Some(Evaluated {
            columns,
            own: own_columns,
            held,
            empty: given.empty + cut,
            posterior,
        })
    }
}

/// A set at one choice and scale of each member.
struct Evaluated {
    columns: Vec<usize>,
    own: Own,
    held: Held,
    /// Log likelihood where all of its columns are zero.
    empty: f64,
    posterior: Truncated,
}

impl Evaluated {
    fn log_likelihood(&self) -> f64 {
        self.empty + self.posterior.log_evidence
    }
}

/// A set with a candidate more, ascending.
fn with(set: &[usize], candidate: usize) -> Vec<usize> {
    let mut larger = [set, &[candidate]].concat();
    larger.sort_unstable();
    larger
}

/// Logarithm of a sum of exponentials.
pub(crate) fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let top = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if !top.is_finite() {
        return top;
    }
    top + logs.map(|log| (log - top).exp()).sum::<f64>().ln()
}
