//! `verdict.json`, the answer that other programs read. Its names are a contract.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use hydro_effects::{Id, Medium};

/// Schema of [`Verdict`].
pub const SCHEMA: &str = "hydro-gap-verdict/1";

/// Kind of answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Effects were named, added and verified.
    Named,
    /// Several explanations that the data cannot tell apart.
    Confusable,
    /// Simulation and measurement agree within noise and nominal uncertainty.
    NoGap,
    /// A structured difference that no effect of the catalogue explains with plausible values.
    Unknown,
}

/// One parameter with its interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    /// Its name in the catalogue.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// 95 % interval: of the fit, and of the form where the effect idealises ([`hydro_effects::Card::idealised`]); a
    /// bootstrap's is of the trials alone.
    pub ci95: [f64; 2],
    /// Its value in each trial, by name, where it differs from trial to trial; `value` and `ci95` are then of the mean about
    /// which the trials' values lie.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub by_trial: BTreeMap<String, f64>,
}

/// One effect with its probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedEffect {
    /// Which.
    pub effect: Id,
    /// Name of the body, joint, actuator or sensor.
    pub target: String,
    /// Posterior probability, 0 to 1.
    pub probability: f64,
    /// True where it only stands in for something outside the catalogue.
    pub surrogate: bool,
    /// Part of the excess over noise that comes back where it alone is left out, 0 to 1; null for what is not named. Of an effect on
    /// several targets, the part of all of them.
    #[serde(default)]
    pub explained: Option<f64>,
    /// Values.
    pub parameters: Vec<FittedParameter>,
}

/// A window of one sensor in which the nominal fails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Name of the trial.
    pub trial: String,
    /// Name of the sensor.
    pub sensor: String,
    /// Start of the window [s].
    pub t_start: f64,
    /// End of the window [s].
    pub t_end: f64,
    /// Part of the whole excess, 0 to 1.
    pub share: f64,
    /// Probability of so much under no gap, corrected for the number of windows looked at.
    pub p_value: f64,
}

/// A condition under which the nominal fails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Regime {
    /// A readable condition, such as `speed > 0.3`.
    pub rule: String,
    /// Part of the whole excess inside, 0 to 1.
    pub share: f64,
    /// Part of the samples inside, 0 to 1.
    #[serde(default)]
    pub samples: f64,
}

/// Error of one sensor before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorGap {
    /// NRMSE of the nominal model.
    pub before: f64,
    /// NRMSE of the patched model.
    pub after: f64,
    /// `1 - after / before`.
    pub reduction: f64,
    /// 95 % interval of the reduction, bootstrap over trials.
    pub ci95: [f64; 2],
}

/// Errors on held-out trials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// `nrmse`.
    pub metric: String,
    /// Pooled error of the nominal model; null where there was nothing held out.
    pub before: Option<f64>,
    /// Pooled error of the patched model.
    pub after: Option<f64>,
    /// `1 - after / before`.
    pub reduction: Option<f64>,
    /// 95 % interval of the reduction, bootstrap over trials.
    pub ci95: Option<[f64; 2]>,
    /// Held-out trials.
    pub n_holdout_trials: usize,
    /// Errors by sensor.
    pub per_sensor: BTreeMap<String, SensorGap>,
}

/// Correction of one sensor: measured(t) = scale * sensor(t - delay) + bias.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SensorPatch {
    /// One number, or one a component.
    pub bias: Bias,
    /// Factor.
    pub scale: f64,
    /// Delay [s].
    pub delay: f64,
}

impl Default for SensorPatch {
    fn default() -> Self {
        Self::none(1)
    }
}

impl SensorPatch {
    /// No correction, for a sensor of `components` components.
    pub fn none(components: usize) -> Self {
        Self {
            bias: Bias::from_components(vec![0.0; components]),
            scale: 1.0,
            delay: 0.0,
        }
    }
}

/// A bias of a scalar or of a vector sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Bias {
    /// Bias of a scalar.
    Scalar(f64),
    /// Bias of each component.
    Vector(Vec<f64>),
}

impl Bias {
    /// A number for one component, else a vector.
    pub fn from_components(components: Vec<f64>) -> Self {
        match components[..] {
            [one] => Self::Scalar(one),
            _ => Self::Vector(components),
        }
    }

    /// Adds to a component; a scalar has the first alone.
    pub(crate) fn add(&mut self, component: usize, bias: f64) {
        match self {
            Self::Scalar(one) => *one += bias,
            Self::Vector(components) => components[component] += bias,
        }
    }
}

/// How the method fares on trials simulated from its own answers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Level of the test for any gap: the part of trials without a gap in which one would be claimed.
    pub alarm_level: f64,
    /// Probability that trials without a gap look so much like a gap.
    pub alarm: f64,
    /// Of trials in which the second set is true, the part in which the first is found likeliest; effects by name, joined by
    /// `+`, `none` where nothing is missing.
    pub confusion: BTreeMap<String, BTreeMap<String, f64>>,
}

/// The patched model and its sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Patch {
    /// The patched model, relative to the output folder.
    pub model: String,
    /// Corrections of sensors by name.
    pub sensors: BTreeMap<String, SensorPatch>,
    /// Effects in it that are not named: the undecided members of the likeliest set.
    #[serde(default)]
    pub stand_ins: Vec<Id>,
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// [`SCHEMA`].
    pub schema: String,
    /// Kind of answer.
    pub verdict: Outcome,
    /// Effects that are named and were added; what else was added stands in `patch.stand_ins`.
    pub named: Vec<Id>,
    /// All with a non-negligible posterior, the likeliest first.
    pub effects: Vec<FittedEffect>,
    /// The medium that was taken to be about the robot: as `--medium` says, or as the model tells.
    #[serde(default)]
    pub medium: Medium,
    /// Part of the excess over noise that the named effects take away together, 0 to 1; null where none is named.
    #[serde(default)]
    pub explained: Option<f64>,
    /// The rest of it; null where there is no gap.
    #[serde(default)]
    pub unexplained: Option<f64>,
    /// How far the answer can be trusted, by simulation.
    #[serde(default)]
    pub calibration: Calibration,
    /// Effects that the data cannot tell apart.
    pub confusion_set: Vec<Id>,
    /// The experiment that would tell.
    pub next_experiment: Option<String>,
    /// Windows in which the nominal fails, the largest share first.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// Conditions under which it fails, the largest share first.
    pub regime: Vec<Regime>,
    /// Error before and after.
    pub gap: Gap,
    /// True where held-out trials confirm what was added.
    pub verified: bool,
    /// True where what fitted best was put aside, for it predicts trials that were left out worse than the nominal: `unknown`.
    #[serde(default)]
    pub contradicted: bool,
    /// Doubts about the answer: numbers of the nominal that moved far, values at the end of what is plausible.
    #[serde(default)]
    pub doubts: Vec<String>,
    /// Why it is not verified.
    pub refused_because: Option<String>,
    /// The patched model; `None` where nothing was added.
    pub patch: Option<Patch>,
}
