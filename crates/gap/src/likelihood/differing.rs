//! Candidates that may differ from trial to trial, in a search.

use crate::{
    likelihood::{
        found::{Found, Member},
        level::Left,
        quadratic::Quadratic,
        search::{Search, log_sum},
        truncated_evidence,
        truncated_normal::Bounds,
    },
    options::LikelihoodOptions,
};

impl Search<'_> {
    /// Candidates that may be added to a set and may differ from trial to trial, where that is likelier than one value of all: log
    /// evidence of values of each trial's own, the set's values held.
    pub(super) fn by_trial(&self, set: &Found) -> Vec<(usize, f64)> {
        let left = self.left(set);
        if left.is_empty() {
            return Vec::new();
        }
        let options = self.choices.options();
        let log = |candidate: usize| {
            let mut logs = Vec::new();
            for columns in &self.choices.of[&candidate] {
                let columns = self.amplitudes(columns);
                let trials: Vec<Quadratic> = left.iter().map(|of| of.select(&columns)).collect();
                if !(leaves_trace(&trials, options) && differ(&trials)) {
                    continue;
                }
                let free = vec![Bounds::FREE; columns.len()];
                for scale in 0..options.prior_scales.len() {
                    let (sd, _) = self.prior(&columns, scale);
                    let log = |size: &f64| {
                        let log = |of: &Quadratic| {
                            let found =
                                truncated_evidence::evidence(&of.a, &of.b, &(*size * &sd), &free);
                            found.map_or(0.0, |of| of.log_evidence)
                        };
                        trials.iter().map(log).sum::<f64>()
                    };
                    logs.extend(options.own_sizes.iter().map(log));
                }
            }
            let log = log_sum(logs.iter().copied()) - (logs.len() as f64).ln();
            (!logs.is_empty()).then_some((candidate, log + options.differs.ln()))
        };
        self.may_be_added(set).filter_map(log).collect()
    }

    /// Log likelihood that no set exceeds: that of the best values of all parameters, and what values of each trial's own beside
    /// the likeliest set so far may add to first order.
    pub(crate) fn most(&self, likeliest: &Found) -> f64 {
        let Some(found) = self.again(likeliest) else {
            return f64::INFINITY;
        };
        let left = self.left(&found);
        let choices = self.may_be_added(&found);
        let choices = choices.flat_map(|candidate| &self.choices.of[&candidate]);
        let gain = |columns: &Vec<usize>| {
            let columns = self.amplitudes(columns);
            let trials: Vec<Quadratic> = left.iter().map(|of| of.select(&columns)).collect();
            match differ(&trials) {
                true => trials.iter().map(Quadratic::most_gain).sum(),
                false => 0.0,
            }
        };
        self.level.most() + choices.map(gain).fold(0.0, f64::max)
    }

    /// Some members of a found set with one value for all trials, where one of each trial's own is likelier to first order.
    pub(super) fn differing(&self, found: &Found, some: &impl Fn(usize) -> bool) -> Vec<usize> {
        let may_differ =
            |of: &&Member| of.3.is_none() && some(of.0) && self.choices.may_differ(of.0);
        let members: Vec<&Member> = found.members.iter().filter(may_differ).collect();
        let left = match members.is_empty() {
            true => Vec::new(),
            false => self.left(found),
        };
        let differ = |(candidate, choice, ..): &&&Member| {
            let columns = self.amplitudes(&self.choices.of[candidate][*choice]);
            let trials: Vec<Quadratic> = left.iter().map(|of| of.select(&columns)).collect();
            !trials.is_empty() && differ(&trials)
        };
        members.iter().filter(differ).map(|of| of.0).collect()
    }

    fn may_be_added(&self, set: &Found) -> impl Iterator<Item = usize> {
        let beside = self.choices.beside(&set.set);
        beside.filter(|candidate| self.choices.may_differ(*candidate))
    }

    /// What a set leaves of every trial, where there are several and the level holds the directions.
    fn left(&self, set: &Found) -> Vec<Left<'_>> {
        match self.has_trials() {
            true => self.level.left(self.choices.problem, set),
            false => Vec::new(),
        }
    }
}

/// True where some trial tells of the parameters.
fn leaves_trace(trials: &[Quadratic], options: &LikelihoodOptions) -> bool {
    let mut told = trials.iter().map(Quadratic::information);
    told.any(|information| information > options.least_information)
}

/// True where trials are likelier with values of their own than with a common one: by the evidence of the deviations that are
/// likeliest, were every trial to tell alike.
fn differ(trials: &[Quadratic]) -> bool {
    let Some(common) = sum(trials) else {
        return false;
    };
    let apart: f64 = trials.iter().map(Quadratic::most_gain).sum();
    let excess = apart - common.most_gain();
    let half = 0.5 * (common.b.len() * (trials.len() - 1)) as f64;
    half > 0.0 && excess > half && excess - half > half * (excess / half).ln()
}

fn sum(trials: &[Quadratic]) -> Option<Quadratic> {
    let first = trials.first()?.clone();
    Some(trials[1..].iter().fold(first, |sum, of| Quadratic {
        q: sum.q + of.q,
        b: sum.b + &of.b,
        a: sum.a + &of.a,
    }))
}
