//! Results of the stages, as the next stage and the report read them. Written to the output folder as
//! `find.json`, `name.json`, `add.json`, `verify.json`.

use std::collections::BTreeMap;

use hydro_effects::{Id, Medium};
use serde::{Deserialize, Serialize};

use crate::output::verdict::{
    Calibration, FittedEffect, FittedParameter, Gap, Outcome, Place, Regime, SensorPatch,
};

/// One number that is compared with a measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Name of the sensor.
    pub sensor: String,
    /// Component (of an attitude: of the rotation vector).
    pub component: usize,
    /// Unit of the residual.
    pub unit: String,
    /// Standard deviation of the noise as used.
    pub noise: f64,
    /// Noise declared in the MJCF; `None` where it declares none.
    pub declared_noise: Option<f64>,
}

/// Squared, whitened residual a window of one trial, above what noise gives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeatMap {
    /// Name of the trial.
    pub trial: String,
    /// Edges of the windows [s], one more than windows.
    pub edges: Vec<f64>,
    /// Mean squared whitened residual a window, by sensor (1 is noise alone); `None` where no sample is.
    pub sensors: BTreeMap<String, Vec<Option<f64>>>,
}

/// Windows and conditions in which the nominal fails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Schema: `hydro-gap-find/1`.
    pub schema: String,
    /// Trials that everything before `verify` uses.
    pub fit_trials: Vec<String>,
    /// Trials that nothing before `verify` opens.
    pub held_out_trials: Vec<String>,
    /// Channels compared.
    pub channels: Vec<Channel>,
    /// The medium that is taken to be about the robot.
    #[serde(default)]
    pub medium: Medium,
    /// Length of a segment [s].
    pub segment: f64,
    /// Mean squared whitened residual after the nominal's uncertainties are fitted; 1 is noise alone.
    pub excess: f64,
    /// Probability of the largest window under no gap (maxT over windows, by simulated nulls).
    pub p_value: f64,
    /// Share of the excess by sensor.
    pub by_sensor: BTreeMap<String, f64>,
    /// Windows with significant excess, the largest first.
    pub places: Vec<Place>,
    /// Readable rules, the largest share first.
    pub regime: Vec<Regime>,
    /// Heat maps of the report.
    pub heat_maps: Vec<HeatMap>,
    /// Remarks on the data.
    pub remarks: Vec<String>,
}

/// One set of effects that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Effects and their targets; empty: nothing is missing.
    pub effects: Vec<(Id, String)>,
    /// Log evidence less that of the empty set [nat].
    pub log_evidence: f64,
    /// Posterior probability.
    pub probability: f64,
    /// Part of the excess that it leaves unexplained, 0 to 1.
    pub unexplained: f64,
    /// True for the set about which the readings were linearised: the evidence of others is of first order.
    pub refitted: bool,
}

/// Which effect is missing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Named {
    /// Schema: `hydro-gap-name/1`.
    pub schema: String,
    /// Kind of answer before verification.
    pub outcome: Outcome,
    /// The effects that are named, to be added.
    pub chosen: Vec<FittedEffect>,
    /// The likeliest of what is undecided, added beside them: something is missing, whichever it is.
    #[serde(default)]
    pub stand_ins: Vec<FittedEffect>,
    /// All effects with a non-negligible posterior, the likeliest first.
    pub effects: Vec<FittedEffect>,
    /// Effects that the data cannot tell apart.
    pub confusion_set: Vec<Id>,
    /// Experiment that would tell them apart.
    pub next_experiment: Option<String>,
    /// The sets, the likeliest first.
    pub ranking: Vec<Hypothesis>,
    /// Fitted uncertain numbers of the nominal (name, value, standard deviation) under the chosen set.
    pub nuisances: Vec<(String, f64, f64)>,
    /// Part of the excess that the chosen effects explain; `None` where none are chosen.
    #[serde(default)]
    pub explained: Option<f64>,
    /// How far the answer can be trusted, by simulation.
    #[serde(default)]
    pub calibration: Calibration,
    /// Remarks for the reader.
    pub remarks: Vec<String>,
}

/// A number of the nominal model that was fitted beside the effects and written with them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refitted {
    /// Its name: `hull.mass`.
    pub what: String,
    /// Its value in the nominal model.
    pub from: f64,
    /// Its value in the patched model.
    pub to: f64,
    /// Unit of both; `x nominal` where they are factors on what the nominal has.
    pub unit: String,
    /// Standard deviation that the trials leave it, in the same unit.
    pub deviation: f64,
}

/// Effects and numbers written into the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Added {
    /// Schema: `hydro-gap-add/1`.
    pub schema: String,
    /// Effects, as written.
    pub effects: Vec<FittedEffect>,
    /// Corrections of sensors.
    pub sensors: BTreeMap<String, SensorPatch>,
    /// Block-bootstrap intervals over trials beside the Laplace ones: (effect, target, parameters).
    pub bootstrap: Vec<(Id, String, Vec<FittedParameter>)>,
    /// Numbers of the nominal model, as written.
    #[serde(default)]
    pub numbers: Vec<Refitted>,
    /// The fit without each of its trials, for a replay of that trial.
    #[serde(default)]
    pub cross_fit: Vec<WithoutTrial>,
    /// The fit of all trials, where an effect differs from trial to trial.
    #[serde(default)]
    pub own: Option<OwnFit>,
    /// Numbers of the nominal as they are fitted where nothing is added, in the model's order: relative, or
    /// metres for a centre of mass.
    #[serde(default)]
    pub recalibrated: Vec<f64>,
    /// [`crate::plant::Quantity::CommandsBefore`] of the trials, as fitted.
    #[serde(default)]
    pub commands_before: f64,
    /// The patched model, relative to the output folder; none where there was nothing to write.
    pub model: Option<String>,
    /// Unified diff of nominal against patched MJCF.
    pub diff: String,
    /// Remarks for the reader.
    pub remarks: Vec<String>,
}

impl Named {
    /// All effects that are added.
    pub fn added(&self) -> Vec<FittedEffect> {
        self.chosen.iter().chain(&self.stand_ins).cloned().collect()
    }
}

impl Added {
    /// True where a candidate model was written; else the remarks say why there is none.
    pub fn is_written(&self) -> bool {
        self.model.is_some()
    }
}

/// A fit that left one trial out. Which effects are missing was decided with it in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WithoutTrial {
    /// Name of the trial.
    pub trial: String,
    /// Uncertain numbers of the nominal, in the model's order: relative, or metres for a centre of mass.
    #[serde(rename = "knobs", alias = "nuisances")]
    pub nuisances: Vec<f64>,
    /// Effects, those of sensors too: which, on what, values in the order of the catalogue.
    pub effects: Vec<(Id, String, Vec<f64>)>,
    /// Nuisance parameters of the nominal fitted without effects, in the same order.
    pub recalibrated: Vec<f64>,
    /// Gain in log predictive density of the trial against these [nat].
    pub gain: f64,
}

/// A fit of effects of which some differ from trial to trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OwnFit {
    /// The fit of all trials, its values the common ones.
    pub fit: WithoutTrial,
    /// Effects that differ from trial to trial: which, on what, standard deviation of a trial's own value about the common one
    /// by parameter.
    pub spread: Vec<(Id, Vec<String>, Vec<f64>)>,
}

/// One channel of one held-out rollout, for the eye.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overlay {
    /// Name of the trial.
    pub trial: String,
    /// Name of the sensor.
    pub sensor: String,
    /// Component.
    pub component: usize,
    /// Unit.
    pub unit: String,
    /// Times [s].
    pub time: Vec<f64>,
    /// Measured; none where a sample was dropped.
    pub measured: Vec<Option<f64>>,
    /// Nominal model; none between rollouts, so that a line breaks there.
    pub before: Vec<Option<f64>>,
    /// Patched model.
    pub after: Vec<Option<f64>>,
}

/// Error at one horizon.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Horizon {
    /// Length of the open-loop rollout [s].
    pub seconds: f64,
    /// NRMSE before.
    pub before: f64,
    /// NRMSE after.
    pub after: f64,
    /// 95 % interval of the reduction.
    pub ci95: [f64; 2],
}

/// Errors on held-out trials, and whether the addition is accepted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verified {
    /// Schema: `hydro-gap-verify/1`.
    pub schema: String,
    /// Errors before and after.
    pub gap: Gap,
    /// Errors by horizon.
    pub horizons: Vec<Horizon>,
    /// For the eye.
    pub overlays: Vec<Overlay>,
    /// True where it is accepted.
    pub accepted: bool,
    /// Why not.
    pub refused_because: Option<String>,
    /// True where the addition predicts trials that were left out clearly worse than the nominal, as it is or with its numbers
    /// refitted, and no better than it as it is: what fits best is no explanation.
    #[serde(default)]
    pub contradicted: bool,
    /// Pooled error of the nominal with its numbers refitted and nothing added: what of the reduction is not
    /// the effects'.
    #[serde(default)]
    pub recalibrated: Option<f64>,
    /// True where every trial was left out once of the fit that it judges (ten trials or fewer).
    pub cross_fitted: bool,
    /// Remarks for the reader.
    pub remarks: Vec<String>,
}

/// All that a report shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The nominal model, as given.
    pub model: String,
    /// The command.
    pub command: String,
    /// First stage.
    pub found: Found,
    /// Second stage.
    pub named: Named,
    /// Third stage; none where nothing was to be added.
    pub added: Option<Added>,
    /// Fourth stage; none where nothing was to be verified.
    pub verified: Option<Verified>,
    /// The answer.
    pub verdict: crate::output::verdict::Verdict,
    /// Seconds by stage.
    pub seconds: BTreeMap<String, f64>,
}

impl Record {
    /// True where a candidate model stands beside the nominal.
    pub fn is_patched(&self) -> bool {
        self.added.as_ref().is_some_and(Added::is_written)
    }
}
