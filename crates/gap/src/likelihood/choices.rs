//! The candidates that may stand in a set, and the columns of the Gram matrices that are theirs.

use std::collections::{BTreeMap, BTreeSet};

use hydro_effects::{Id, effect};

use crate::{
    likelihood::{
        directions::{self, Direction},
        level::Level,
        truncated_normal::Bounds,
    },
    options::LikelihoodOptions,
    problem::{point::Point, problem::Problem},
};

/// A parameter as a column of the Gram matrices.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub(super) bounds: Bounds,
    /// True where the scale mixture does not touch it.
    pub(super) shapes: bool,
}

/// Columns of every candidate: one choice for what the point holds, one for every shape that is tried otherwise.
#[derive(Clone)]
pub(crate) struct Choices<'p> {
    pub(super) problem: &'p Problem<'p>,
    pub(super) columns: Vec<Column>,
    pub(super) of: BTreeMap<usize, Vec<Vec<usize>>>,
    /// Candidates that are added to no set.
    left_out: BTreeSet<usize>,
    /// Effects of a set at most.
    pub(super) largest: usize,
    /// Log likelihood without effects beside the unmodelled forces that make it likeliest, where the sets of several levels are
    /// compared.
    pub(super) without_effects: Option<f64>,
}

impl<'p> Choices<'p> {
    pub(crate) fn new(problem: &'p Problem<'p>, point: &Point, directions: &[Direction]) -> Self {
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
            let id = problem.candidates[direction.candidate].effect;
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
                    .all(|((a, b), p)| a == b || directions::adds_up(id, p))
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
        Self {
            problem,
            columns,
            of,
            left_out: BTreeSet::new(),
            largest: problem.settings.options.likelihood.largest,
            without_effects: None,
        }
    }

    /// The same for sets that are compared with none, whose log likelihood is this.
    pub(crate) fn against_none(mut self, log_likelihood: f64) -> Self {
        self.without_effects = Some(log_likelihood);
        self
    }

    /// Forgets candidates that change no reading ([`LikelihoodOptions::silent`]): of those the trials say nothing, and an expected one would
    /// stay as likely as it was beforehand. `own`: candidates of the point, which stay.
    pub(crate) fn heed(&mut self, levels: &[Level], own: &[usize]) {
        let least = self.options().silent;
        self.of.retain(|candidate, choices| {
            let mut columns = choices.iter().flatten();
            own.contains(candidate)
                || columns.any(|column| levels.iter().any(|of| of.moved_by(*column) >= least))
        });
    }

    /// Adds a candidate to no set from now on.
    pub(crate) fn leave_out(&mut self, candidate: usize) {
        self.left_out.insert(candidate);
    }

    pub(super) fn options(&self) -> &LikelihoodOptions {
        &self.problem.settings.options.likelihood
    }

    /// Bounds of some columns.
    pub(super) fn bounds(&self, columns: &[usize]) -> impl Iterator<Item = Bounds> {
        columns.iter().map(|column| self.columns[*column].bounds)
    }

    /// Candidates that may stand in one set with others.
    pub(super) fn beside(&self, set: &[usize]) -> impl Iterator<Item = usize> {
        let all = &self.problem.candidates;
        let all_of = self.of.keys().copied();
        let all_of = all_of.filter(|candidate| !self.left_out.contains(candidate));
        all_of.filter(move |candidate| {
            (set.iter()).all(|of| {
                of != candidate
                    && !all[*of].clashes(&all[*candidate])
                    && !self.problem.is_one_scale(*of, *candidate)
            })
        })
    }

    /// Expected candidates, each in its plain form; not one whose plain form is forgotten.
    pub(super) fn expected(&self) -> Vec<usize> {
        let mut plain: BTreeMap<(Id, &[String]), usize> = BTreeMap::new();
        for (candidate, of) in self.problem.candidates.iter().enumerate() {
            if self.problem.priors[candidate].is_expected {
                plain.entry(of.mechanism()).or_insert(candidate);
            }
        }
        let plain = plain.into_values();
        plain.filter(|of| self.of.contains_key(of)).collect()
    }

    /// A step in standard deviations of the prior, for a delay of a sensor: below it, it is only when within a step the sensor
    /// reads.
    pub(super) fn least(&self, candidate: usize) -> Option<f64> {
        let of = &self.problem.candidates[candidate];
        let p = of.parameters.first()?;
        (of.effect == Id::SensorDelay).then(|| self.problem.model.timestep / p.prior_sd)
    }

    /// True for an effect that may have a value of each trial's own.
    pub(super) fn may_differ(&self, candidate: usize) -> bool {
        effect(self.problem.candidates[candidate].effect).differs_by_trial()
    }

    /// The same for sets of so many effects at most.
    pub(crate) fn up_to(&self, largest: usize) -> Self {
        let mut of = self.clone();
        of.largest = largest;
        of.without_effects = None;
        of
    }
}
