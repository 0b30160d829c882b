//! Candidates that may differ from trial to trial, in a search.

use crate::likelihood::{
    found::Found,
    quadratic::Quadratic,
    search::{Search, log_sum},
    truncated_evidence,
    truncated_normal::Bounds,
};

impl Search<'_> {
    /// Candidates that may differ from trial to trial, beside a set whose values are held: log evidence of values of each
    /// trial's own, and the most that they could gain.
    pub(super) fn by_trial(&self, set: &Found) -> Vec<(usize, f64, f64)> {
        if !self.has_trials() || !self.level.is_searched {
            return Vec::new();
        }
        let options = self.choices.options();
        let candidates: Vec<usize> = (self.choices.beside(&set.set))
            .filter(|candidate| self.choices.may_differ(*candidate))
            .collect();
        let left = match candidates.is_empty() {
            true => Vec::new(),
            false => self.level.left(self.choices.problem, set),
        };
        let of = |candidate: &usize| {
            let (mut logs, mut most, mut leaves_trace) = (Vec::new(), 0.0_f64, false);
            for columns in &self.choices.of[candidate] {
                let trials: Vec<Quadratic> = (left.iter()).map(|of| of.select(columns)).collect();
                let mut told = trials.iter().map(Quadratic::information);
                leaves_trace |= told.any(|information| information > options.least_information);
                most = most.max(trials.iter().map(Quadratic::most_gain).sum());
                for scale in 0..options.prior_scales.len() {
                    let (sd, _) = self.prior(columns, scale);
                    let log = |size: &f64| {
                        let free = vec![Bounds::FREE; columns.len()];
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
            leaves_trace.then_some((*candidate, log + options.differs.ln(), most))
        };
        candidates.iter().filter_map(of).collect()
    }

    /// Log likelihood that no set exceeds: that of the best values of all parameters, or of some in each trial by itself.
    pub(crate) fn most(&self) -> f64 {
        let own = self
            .whole(&[])
            .map_or_else(Vec::new, |empty| self.by_trial(&empty));
        let own = own.iter().map(|of| of.2).fold(0.0, f64::max);
        self.level.most() + own
    }
}
