//! Prior of a set of effects, and the odds that errors of form stand for some of it.

use hydro_effects::effect;

use crate::likelihood::{choices::Choices, found::Member};

impl Choices<'_> {
    /// Log of the odds that no error of form of the others gives what the members of a set beyond the first explain, together:
    /// a part of what the whole explains each. Expected ones are there by themselves. Values of each trial's own beside others are
    /// one thing more. Effects that idealise nothing have no error of form.
    pub(super) fn log_form_odds(&self, members: &[Member], log_likelihood: f64) -> f64 {
        let idealised = |of: &Member| {
            let of = &self.problem.candidates[of.0];
            effect(of.effect).card().idealised
        };
        if !members.iter().any(idealised) {
            return 0.0;
        }
        let is_unexpected = |of: &&Member| !self.problem.priors[of.0].is_expected;
        let unexpected = members.iter().filter(is_unexpected).count();
        let mut beside = unexpected - usize::from(unexpected == members.len() && unexpected > 0);
        if members.len() > 1 {
            beside += members.iter().filter(|of| of.3.is_some()).count();
        }
        -(beside as f64) * self.options().form_error.powi(2) * self.gain(log_likelihood)
    }

    /// Log of the odds of a set beside its likelihood, but for those of errors of form.
    pub(super) fn log_odds(&self, set: &[usize], log_likelihood: f64) -> f64 {
        self.log_prior(set) + self.log_medium_odds(set, log_likelihood)
    }

    /// Log of the odds of effects of a medium of which the model tells nothing, and that no error of form of dry effects gives what
    /// they explain: a part of what the whole explains, once. Water about a cart or an arm needs a reason.
    fn log_medium_odds(&self, set: &[usize], log_likelihood: f64) -> f64 {
        match set.iter().any(|of| self.problem.priors[*of].is_untold) {
            true => {
                let part = self.options().untold_medium;
                part.ln().min(-part * self.gain(log_likelihood))
            }
            false => 0.0,
        }
    }

    /// Log likelihood that a set gains over no effect [nat]; zero where the two are not compared.
    fn gain(&self, log_likelihood: f64) -> f64 {
        let none = self.without_effects.unwrap_or(f64::INFINITY);
        (log_likelihood - none).max(0.0)
    }

    /// Log prior of a set: so many effects, and these.
    fn log_prior(&self, set: &[usize]) -> f64 {
        let another = self.options().another_effect;
        let priors = || set.iter().map(|candidate| self.problem.priors[*candidate]);
        let unexpected = priors().filter(|of| !of.is_expected).count();
        let mut log = (1.0 - another).ln() + unexpected as f64 * another.ln();
        log += priors().map(|of| of.log_share).sum::<f64>();
        let unaccompanied = (set.iter()).filter(|of| self.problem.is_unaccompanied(**of, set));
        log += unaccompanied.count() as f64 * self.options().unaccompanied.ln();
        log + (1..=unexpected).map(|at| (at as f64).ln()).sum::<f64>()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use hydro_effects::{Id, Medium};

    use crate::{
        likelihood::choices::Choices,
        tests::{fake::RigidBody, on_prepared, trial},
    };

    /// A tenth of what is explained beyond no effect, odds of one to ten where that is little, and nothing of drag, for air is everywhere.
    #[test]
    fn water_of_which_the_model_tells_nothing_needs_a_reason() {
        for (medium, part, least) in [(Medium::None, 0.1, 0.1_f64.ln()), (Medium::Water, 0.0, 0.0)]
        {
            let trials = vec![trial("one", &[], &[0.0, 0.0], 1, 1.0)];
            on_prepared(&RigidBody::within(medium), trials, |problem, _| {
                let choices = Choices::new(problem, &problem.origin(), &[]).against_none(-100.0);
                let odds = |id: Id, log_likelihood: f64| {
                    let mut all = problem.candidates.iter();
                    let at = all.position(|of| of.effect == id).unwrap();
                    choices.log_medium_odds(&[at], log_likelihood)
                };
                let expected = -part * 40.0;
                assert!((odds(Id::AddedMass, -60.0) - expected).abs() < 1e-12);
                assert_eq!(odds(Id::QuadraticDrag, -60.0), 0.0);
                assert_eq!(odds(Id::AddedMass, -95.0), least);
                assert_eq!(odds(Id::AddedMass, -130.0), least);
            });
        }
    }
}
