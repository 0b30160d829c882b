//! The identification problem that every stage starts from: fit trials, their motions, channels, candidate effects.

use hydro_effects::{Id, Medium, effect};

use crate::{
    options::Options,
    plant::{Plant, PlantDescription},
    problem::{
        candidates::{Candidate, Prior},
        channels::{Channels, MeasuredTrial},
        segments::EstimatedMotion,
        sensor_noise::Drifting,
        uncertainty::Uncertainty,
    },
};

/// Settings of the workflow.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Uncertainty of the nominal.
    pub uncertainty: Uncertainty,
    /// Seed of every draw.
    pub seed: u64,
    /// The medium where the user says it; what the model tells of otherwise.
    pub medium: Option<Medium>,
    /// Effects of the user's own, tried beside those of the catalogue.
    pub own_effects: Vec<Id>,
    /// Statistical choices.
    pub options: Options,
}

/// Trials made ready.
pub struct Problem<'a> {
    pub(crate) plant: &'a dyn Plant,
    pub(crate) model: &'a PlantDescription,
    pub(crate) trials: Vec<MeasuredTrial>,
    pub(crate) motions: Vec<EstimatedMotion>,
    pub(crate) channels: Channels,
    /// Channels that declare no noise and may drift.
    pub(crate) drifting: Vec<Drifting>,
    pub(crate) candidates: Vec<Candidate>,
    /// Prior of each candidate.
    pub(crate) priors: Vec<Prior>,
    /// The body of every tree that the water holds most of: off-diagonal terms of an effect on it are uncertain.
    pub(crate) hulls: Vec<String>,
    /// Nuisance parameters in use: row of `PlantDescription::nuisances`, and standard deviation of the prior.
    pub(crate) nuisances: Vec<(usize, f64)>,
    pub(crate) settings: Settings,
    /// Standard deviation of the white noise that each command was logged with, and that was taken off it; zero where a command
    /// is taken to be exact.
    pub(crate) command_noise: Vec<f64>,
    /// Largest command of every actuator in the trials.
    pub(crate) commands: Vec<f64>,
    pub(crate) remarks: Vec<String>,
}

impl Problem<'_> {
    /// True where one of two candidates is the gain of every actuator and the other an expected added mass: a factor on all
    /// forces is then a factor on all that is missing, and the nominal's gain is taken to hold.
    pub(crate) fn is_one_scale(&self, one: usize, other: usize) -> bool {
        let is_gain = |at: usize| {
            let of = &self.candidates[at];
            of.effect == Id::ActuatorGain && of.targets.len() == self.model.actuators.len()
        };
        let is_added =
            |at: usize| self.candidates[at].effect == Id::AddedMass && self.priors[at].is_expected;
        (is_gain(one) && is_added(other)) || (is_gain(other) && is_added(one))
    }

    /// The medium that is taken to be about the robot.
    pub(crate) fn medium(&self) -> Medium {
        self.settings.medium.unwrap_or(self.model.medium)
    }

    /// True for a candidate of a set without the effects that it presupposes, in a model without fluid.
    pub(crate) fn is_unaccompanied(&self, candidate: usize, set: &[usize]) -> bool {
        let of = &self.candidates[candidate];
        let presupposed = effect(of.effect).presupposes();
        let accompanies = |other: &usize| {
            let other = &self.candidates[*other];
            presupposed.contains(&other.effect)
                && of
                    .targets
                    .iter()
                    .any(|target| other.targets.contains(target))
        };
        !presupposed.is_empty() && !self.model.has_fluid && !set.iter().any(accompanies)
    }

    /// The commands that were logged with noise, and its standard deviations.
    pub(crate) fn noisy_commands(&self) -> impl Iterator<Item = (usize, f64)> {
        let all = self.command_noise.iter().copied().enumerate();
        all.filter(|(_, sd)| *sd > 0.0)
    }

    /// Time constant of the slow error of a sensor that declares no noise, in a trial with rows of a period [s].
    pub(crate) fn drift_time(&self, period: f64) -> f64 {
        self.settings.options.likelihood.drift_rows * period
    }
}

impl std::fmt::Debug for Problem<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Problem")
            .field("trials", &self.trials.len())
            .finish_non_exhaustive()
    }
}
