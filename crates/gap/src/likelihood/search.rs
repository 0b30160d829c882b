//! The search over sets of effects on the Gram matrices of the filter.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    fit::{
        hypothesis::Point, laplace::Quadratic, segmented_problem::SegmentedProblem,
        truncated_normal::Bounds,
    },
    likelihood::truncated_evidence::{self, Truncated},
    options::LikelihoodOptions,
    select::screen::{Direction, PHASE},
};

/// The likelihood at one level of unmodelled forces, uncertain numbers of the nominal integrated out.
pub(crate) struct Level {
    pub(crate) force: f64,
    /// Log likelihood of no effect.
    pub(crate) empty: f64,
    /// Likelihood of the parameters beyond the uncertain numbers.
    pub(crate) quadratic: Quadratic,
    /// The same with them.
    pub(crate) whole: Quadratic,
}

impl Level {
    pub(crate) fn new(
        force: f64,
        gram: &DMatrix<f64>,
        half_log_determinant: f64,
        nuisances: usize,
    ) -> Option<Self> {
        let whole = Quadratic::from_gram(gram);
        let quadratic = whole.marginal(nuisances)?;
        let mut head = whole.a.view((0, 0), (nuisances, nuisances)).into_owned();
        for axis in 0..nuisances {
            head[(axis, axis)] += 1.0;
        }
        let logs: f64 = head.cholesky()?.l_dirty().diagonal().map(f64::ln).sum();
        Some(Self {
            force,
            empty: -0.5 * quadratic.q - half_log_determinant - logs,
            quadratic,
            whole,
        })
    }
}

/// A parameter as a column of the Gram matrices.
#[derive(Clone, Debug)]
struct Column {
    bounds: Bounds,
    /// True where the scale mixture does not touch it.
    shapes: bool,
}

/// Columns of every candidate: one choice for what the point holds, one for every shape that is tried otherwise.
pub(crate) struct Choices {
    columns: Vec<Column>,
    of: BTreeMap<usize, Vec<Vec<usize>>>,
    log_shares: Vec<f64>,
    options: LikelihoodOptions,
    /// Candidates that cannot be in one set.
    clashes: Vec<BTreeSet<usize>>,
}

impl Choices {
    pub(crate) fn new(
        problem: &SegmentedProblem<'_>,
        point: &Point,
        directions: &[Direction],
    ) -> Self {
        let mut columns = Vec::new();
        let mut of: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
        for (candidate, values) in point.candidates.iter().zip(&point.values) {
            let first = columns.len();
            for (p, value) in problem.candidates[*candidate].parameters.iter().zip(values) {
                let about = if p.shapes { *value } else { p.null };
                columns.push(Column {
                    bounds: Bounds {
                        lower: (p.lower - about) / p.prior_sd,
                        upper: (p.upper - about) / p.prior_sd,
                    },
                    shapes: p.shapes,
                });
            }
            of.insert(*candidate, vec![(first..columns.len()).collect()]);
        }
        let own = columns.len();
        for (at, direction) in directions.iter().enumerate() {
            let parameters = &problem.candidates[direction.candidate].parameters;
            let p = &parameters[direction.parameter];
            let about = direction.base[direction.parameter];
            columns.push(Column {
                bounds: Bounds {
                    lower: (p.lower - about) / p.prior_sd,
                    upper: (p.upper - about) / p.prior_sd,
                },
                shapes: false,
            });
            let same = |other: &Direction| {
                let both = other.base.iter().zip(&direction.base).zip(parameters);
                both.into_iter()
                    .all(|((a, b), p)| a == b || p.name == PHASE)
            };
            let choices = of.entry(direction.candidate).or_default();
            match choices
                .iter_mut()
                .find(|choice| same(&directions[choice[0] - own]))
            {
                Some(choice) => choice.push(own + at),
                None => choices.push(vec![own + at]),
            }
        }
        let clashes = (0..problem.candidates.len())
            .map(|a| {
                (0..problem.candidates.len())
                    .filter(|b| problem.candidates[a].clashes(&problem.candidates[*b]))
                    .collect()
            })
            .collect();
        Self {
            columns,
            of,
            log_shares: problem.log_shares.clone(),
            options: problem.options.likelihood.clone(),
            clashes,
        }
    }

    pub(crate) fn candidates(&self) -> impl Iterator<Item = usize> + '_ {
        self.of.keys().copied()
    }

    fn log_prior(&self, set: &[usize]) -> f64 {
        let size = set.len();
        let mut log = (1.0 - self.options.another_effect).ln()
            + size as f64 * self.options.another_effect.ln();
        for (at, candidate) in set.iter().enumerate() {
            log += ((at + 1) as f64).ln() + self.log_shares[*candidate];
        }
        log
    }
}

/// A member of a set: candidate, choice, scale.
pub(crate) type Member = (usize, usize, usize);

/// A set at one level.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) set: Vec<usize>,
    pub(crate) level: usize,
    /// The likeliest choices and scales.
    pub(crate) members: Vec<Member>,
    /// Columns of the members, and their posterior.
    pub(crate) columns: Vec<usize>,
    pub(crate) posterior: Option<Truncated>,
    /// Log posterior, up to a constant.
    pub(crate) log_posterior: f64,
}

/// A level with the choices of all candidates.
pub(crate) struct Search<'a> {
    pub(crate) level: &'a Level,
    pub(crate) number: usize,
    pub(crate) choices: &'a Choices,
}

impl Search<'_> {
    /// The empty set, and every set on the way to the best.
    pub(crate) fn run(&self) -> Vec<Found> {
        let empty = self.found(Vec::new(), Vec::new(), Vec::new(), None, 0.0);
        let mut all = vec![empty.clone()];
        let mut seen: BTreeSet<Vec<usize>> = BTreeSet::from([Vec::new()]);
        let mut front = vec![empty];
        for _ in 0..self.choices.options.largest {
            let mut next = Vec::new();
            for set in &front {
                for candidate in self
                    .additions(set)
                    .into_iter()
                    .take(self.choices.options.evaluated)
                {
                    if seen.insert(with(&set.set, candidate))
                        && let Some(found) = self.full(set, Some(candidate), None)
                    {
                        next.push(found);
                    }
                }
            }
            next.sort_by(|a: &Found, b: &Found| b.log_posterior.total_cmp(&a.log_posterior));
            let best_so_far = all
                .iter()
                .map(|of| of.log_posterior)
                .fold(f64::NEG_INFINITY, f64::max);
            let improved = next.first().is_some_and(|of| {
                of.log_posterior > best_so_far - self.choices.options.enlarged_within
            });
            all.extend(next.iter().cloned());
            front = next;
            front.truncate(self.choices.options.beam);
            if !improved {
                break;
            }
        }
        self.refine(&mut all, &mut seen);
        all
    }

    /// Removals from and exchanges in the best set, as long as they help.
    fn refine(&self, all: &mut Vec<Found>, seen: &mut BTreeSet<Vec<usize>>) {
        for _ in 0..self.choices.options.largest {
            let Some(best) = all
                .iter()
                .max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior))
                .cloned()
            else {
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
                    .take(self.choices.options.evaluated)
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

    fn found(
        &self,
        set: Vec<usize>,
        members: Vec<Member>,
        columns: Vec<usize>,
        posterior: Option<Truncated>,
        gain: f64,
    ) -> Found {
        Found {
            log_posterior: self.level.empty + gain + self.choices.log_prior(&set),
            set,
            level: self.number,
            members,
            columns,
            posterior,
        }
    }

    /// Candidates that may be added to a set, by their posterior to first order, the best first.
    fn additions(&self, set: &Found) -> Vec<usize> {
        let fits = |candidate: &usize| {
            !set.set.contains(candidate)
                && set
                    .set
                    .iter()
                    .all(|of| !self.choices.clashes[*of].contains(candidate))
        };
        let candidates: Vec<usize> = self.choices.candidates().filter(fits).collect();
        let mut found: Vec<(usize, f64)> = candidates
            .par_iter()
            .filter_map(|candidate| {
                let mut logs = Vec::new();
                for columns in &self.choices.of[candidate] {
                    let (a, b) = self.conditional(set, columns);
                    for scale in 0..self.choices.options.prior_scales.len() {
                        let (sd, bounds) = self.prior(columns, scale);
                        let evidence = truncated_evidence::evidence(&a, &b, &sd, &bounds)?;
                        logs.push(evidence.log_evidence);
                    }
                }
                let mean = log_sum(logs.iter().copied()) - (logs.len() as f64).ln();
                let larger = with(&set.set, *candidate);
                Some((*candidate, mean + self.choices.log_prior(&larger)))
            })
            .collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found.into_iter().map(|(candidate, _)| candidate).collect()
    }

    /// The quadratic in some columns with a set's parameters integrated out, its bounds as soft as they were found.
    fn conditional(&self, set: &Found, columns: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let of = self.level.quadratic.select(columns);
        let Some(posterior) = &set.posterior else {
            return (of.a, of.b);
        };
        let all = &self.level.quadratic.a;
        let across = DMatrix::from_fn(set.columns.len(), columns.len(), |row, column| {
            all[(set.columns[row], columns[column])]
        });
        let a = of.a - across.tr_mul(&(&posterior.covariance * &across));
        let b = of.b - across.tr_mul(&posterior.mean);
        (a, b)
    }

    fn prior(&self, columns: &[usize], scale: usize) -> (DVector<f64>, Vec<Bounds>) {
        let of = |column: &usize| &self.choices.columns[*column];
        let sd = columns.iter().map(|column| {
            if of(column).shapes {
                1.0
            } else {
                self.choices.options.prior_scales[scale]
            }
        });
        (
            DVector::from_iterator(columns.len(), sd),
            columns.iter().map(|column| of(column).bounds).collect(),
        )
    }

    /// A set evaluated in full, from a set with a candidate added or one taken out: over all scales and choices of the
    /// changed candidate, then of every other in turn.
    fn full(&self, from: &Found, added: Option<usize>, out: Option<usize>) -> Option<Found> {
        let mut members: Vec<Member> = from
            .members
            .iter()
            .copied()
            .filter(|of| Some(of.0) != out)
            .collect();
        if let Some(candidate) = added {
            members.push(self.untried(candidate));
        }
        self.ascend(members, added)
    }

    /// A member before its choices and scales are tried: the first choice, the middle scale.
    fn untried(&self, candidate: usize) -> Member {
        (candidate, 0, self.choices.options.prior_scales.len() / 2)
    }

    /// The set of all candidates of the point.
    pub(crate) fn whole(&self, candidates: &[usize]) -> Option<Found> {
        self.ascend(
            candidates.iter().map(|of| self.untried(*of)).collect(),
            None,
        )
    }

    fn ascend(&self, mut members: Vec<Member>, added: Option<usize>) -> Option<Found> {
        members.sort_unstable();
        let mut set: Vec<usize> = members.iter().map(|of| of.0).collect();
        set.sort_unstable();
        if members.is_empty() {
            return Some(self.found(Vec::new(), Vec::new(), Vec::new(), None, 0.0));
        }
        let mut visited: BTreeMap<Vec<Member>, (f64, Vec<usize>, Truncated)> = BTreeMap::new();
        let mut order: Vec<usize> = (0..members.len()).collect();
        order.sort_by_key(|at| Some(members[*at].0) != added);
        for at in order {
            let candidate = members[at].0;
            let mut best: Option<(f64, Member)> = None;
            for choice in 0..self.choices.of[&candidate].len() {
                for scale in 0..self.choices.options.prior_scales.len() {
                    let mut tried = members.clone();
                    tried[at] = (candidate, choice, scale);
                    let log = match visited.get(&tried) {
                        Some((log, ..)) => *log,
                        None => {
                            let Some((columns, posterior)) = self.evaluate(&tried) else {
                                continue;
                            };
                            let log = posterior.log_evidence;
                            visited.insert(tried.clone(), (log, columns, posterior));
                            log
                        }
                    };
                    if best.is_none_or(|(so_far, _)| log > so_far) {
                        best = Some((log, tried[at]));
                    }
                }
            }
            members[at] = best?.1;
        }
        let ways: f64 = set
            .iter()
            .map(|of| {
                ((self.choices.of[of].len() * self.choices.options.prior_scales.len()) as f64).ln()
            })
            .sum();
        let gain = log_sum(visited.values().map(|of| of.0)) - ways;
        let (_, columns, posterior) = visited.remove(&members)?;
        Some(self.found(set, members, columns, Some(posterior), gain))
    }

    fn evaluate(&self, members: &[Member]) -> Option<(Vec<usize>, Truncated)> {
        let mut columns = Vec::new();
        let mut sds = Vec::new();
        let mut bounds = Vec::new();
        for (candidate, choice, scale) in members {
            let own = &self.choices.of[candidate][*choice];
            let (sd, within) = self.prior(own, *scale);
            columns.extend(own);
            sds.extend(sd.iter().copied());
            bounds.extend(within);
        }
        let of = self.level.quadratic.select(&columns);
        let sd = DVector::from_vec(sds);
        let posterior = truncated_evidence::evidence(&of.a, &of.b, &sd, &bounds)?;
        Some((columns, posterior))
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
