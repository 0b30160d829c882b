//! Verify: open-loop rollouts of the nominal and of the patched model, as loaded from disk, on trials that
//! nobody fitted.
//!
//! With few trials those that were fitted count too, each under a fit that left it out (a cross-fit).
//!
//! Each model starts from its own estimate of the state over a short window at the start of a rollout, and
//! is led through the motion before it, so that neither pays for the other's memory.

use std::{
    collections::BTreeMap,
    ops::Range,
    sync::{Arc, atomic::AtomicUsize},
};

use hydro_effects::Entry;
use rayon::prelude::*;

use crate::{
    error::GapError,
    options::{Options, SegmentOptions},
    output::{
        records::{Channel, Overlay, OwnFit, Verified, WithoutTrial},
        verdict::{Bias, SensorPatch},
    },
    plant::{Plant, PlantDescription},
    problem::{
        channels::{Channels, MeasuredTrial, all_means, deviation},
        problem::Settings,
        segments, sensor_noise,
    },
    progress::Watch,
    rollout::{
        prepare::finest_period,
        sensor_correction::{self, Correction},
        shooting::{self, Trace},
        state_estimation,
        system::System,
    },
    stage::{
        acceptance::{self, Sums, TrialErrors},
        own_values,
    },
    statistics::quantile,
    trial::Trial,
};

/// Trials and sensors drawn in the report.
const SHOWN: usize = 3;

/// Residuals of the rows of one rollout.
type RolloutResiduals = (Range<usize>, Vec<f64>);

/// The models that are compared.
#[derive(Clone, Copy)]
pub struct VerifyInput<'a> {
    /// The nominal.
    pub before: &'a dyn Plant,
    /// The patched model, as loaded from disk.
    pub after: &'a dyn Plant,
    /// Corrections of sensors that go with it.
    pub sensors: &'a BTreeMap<String, SensorPatch>,
    /// Fits that left one trial out, for the trials of `fitted`.
    pub cross_fit: &'a [WithoutTrial],
    /// The fit of all trials, where an effect differs from trial to trial.
    pub own: Option<&'a OwnFit>,
    /// Numbers of the nominal as they are fitted where nothing is added; empty: not known.
    pub recalibrated: &'a [f64],
    /// [`crate::plant::Quantity::CommandsBefore`] of the trials, as fitted.
    pub commands_before: f64,
}

impl std::fmt::Debug for VerifyInput<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VerifyInput").finish_non_exhaustive()
    }
}

/// Compares the nominal with the patched model on trials that nobody fitted, and, for a cross-fit, with
/// the fit that left a trial out on each of the `fitted`. What differs from trial to trial is estimated on the first half of
/// each trial, and the second half is judged.
///
/// # Errors
/// A model that blows up while a start is estimated, nothing to compare, a stop that was asked for.
pub fn verify(
    input: &VerifyInput<'_>,
    held_out: Vec<Trial>,
    fitted: Vec<Trial>,
    noise_of: &[Channel],
    settings: &Settings,
    watch: &Watch<'_>,
) -> Result<Verified, GapError> {
    let model = input.before.description();
    let files = held_out.len();
    let logs: Vec<Trial> = held_out.into_iter().chain(fitted).collect();
    let trials: Vec<MeasuredTrial> = logs
        .iter()
        .cloned()
        .map(|trial| MeasuredTrial::new(trial, model))
        .collect();
    let mut channels = Channels::with_readings(model, &trials);
    sensor_noise::estimate(&mut channels, &trials, &settings.options.candidates);
    for channel in &mut channels.list {
        let known = noise_of
            .iter()
            .find(|of| of.sensor == channel.sensor && of.component == channel.component);
        if let Some(known) = known {
            channel.noise = known.noise;
        }
    }
    let settings = &Settings {
        options: settings.options.for_rows(finest_period(&trials)),
        ..settings.clone()
    };
    let means = all_means(&trials, &channels);
    let has_alone = !input.recalibrated.is_empty();
    let done = AtomicUsize::new(0);
    let outcomes = trials
        .par_iter()
        .enumerate()
        .map(|(at, trial)| {
            watch.check()?;
            let before = CorrectedSystem {
                system: System::of_logs(input.before, input.commands_before),
                corrections: vec![Correction::NONE; model.sensors.len()],
            };
            let fit = match at < files {
                true => input.own.map(|own| &own.fit),
                false => {
                    let mut fits = input.cross_fit.iter();
                    let Some(fit) = fits.find(|fit| fit.trial == trial.name) else {
                        return Ok(None);
                    };
                    Some(fit)
                }
            };
            let own = match fit.zip(input.own) {
                Some(both) => {
                    own_values::estimate(input.before, &logs[at], both, &channels, settings, watch)?
                }
                None => None,
            };
            let from = own.as_ref().map_or(f64::NEG_INFINITY, |of| of.1);
            let fit = own.as_ref().map(|of| &of.0).or(fit.filter(|_| at >= files));
            let recalibrated = match fit.filter(|_| at >= files) {
                Some(fit) => &fit.recalibrated[..],
                None => input.recalibrated,
            };
            let after = if let Some(fit) = fit {
                left_out(input.before, fit)
            } else {
                CorrectedSystem {
                    system: System::of_logs(input.after, input.commands_before),
                    corrections: corrections(model, input.sensors),
                }
            };
            let alone = has_alone.then(|| CorrectedSystem {
                system: System {
                    nuisances: recalibrated.to_vec(),
                    ..System::plain(input.before)
                },
                corrections: before.corrections.clone(),
            });
            let mut sides = vec![&before, &after];
            sides.extend(&alone);
            let outcome = roll(
                &sides,
                (trial, &means[at], from),
                &channels,
                at < SHOWN,
                &settings.options,
            )?;
            watch.count("verifying", &done, trials.len());
            Ok(Some(outcome))
        })
        .collect::<Result<Vec<Option<TrialErrors>>, GapError>>()?;
    let outcomes: Vec<TrialErrors> = outcomes.into_iter().flatten().collect();
    Ok(acceptance::summary(
        &channels,
        outcomes,
        files,
        has_alone,
        (input.cross_fit.iter())
            .map(|fit| fit.gain / input.cross_fit.len() as f64)
            .reduce(|a, b| a + b),
        settings,
    ))
}

/// A model and the corrections of its sensors.
struct CorrectedSystem<'a> {
    system: System<'a>,
    corrections: Vec<Correction>,
}

fn left_out<'a>(plant: &'a dyn Plant, fit: &WithoutTrial) -> CorrectedSystem<'a> {
    let entries: Vec<Entry> = fit
        .effects
        .iter()
        .map(|(effect, target, values)| Entry {
            effect: *effect,
            target: target.clone(),
            parameters: values.clone(),
        })
        .collect();
    CorrectedSystem {
        corrections: sensor_correction::corrections(plant.description(), &entries),
        system: System {
            plant,
            nuisances: fit.nuisances.clone(),
            entries,
        },
    }
}

/// Corrections of the sensors that a verdict names.
fn corrections(
    model: &PlantDescription,
    sensors: &BTreeMap<String, SensorPatch>,
) -> Vec<Correction> {
    let mut corrections = vec![Correction::NONE; model.sensors.len()];
    for (sensor, correction) in model.sensors.iter().zip(&mut corrections) {
        if let Some(patch) = sensors.get(&sensor.name) {
            correction.scale = patch.scale;
            correction.delay = patch.delay;
            match &patch.bias {
                Bias::Scalar(bias) => correction.bias = [*bias; 3],
                Bias::Vector(biases) => {
                    for (value, bias) in correction.bias.iter_mut().zip(biases) {
                        *value = *bias;
                    }
                }
            }
        }
    }
    corrections
}

/// Before, after, and where it is known the nominal refitted; of rollouts that begin at a time or later. `means`: of the
/// trial's channels.
fn roll(
    sides: &[&CorrectedSystem<'_>],
    (trial, means, from): (&MeasuredTrial, &[f64], f64),
    channels: &Channels,
    shown: bool,
    options: &Options,
) -> Result<TrialErrors, GapError> {
    let width = channels.len();
    let mut residuals: Vec<Vec<RolloutResiduals>> = Vec::new();
    for side in sides {
        let mapped = adapted(trial, sides[0].system.plant, side.system.plant);
        let trial = mapped.as_ref().unwrap_or(trial);
        let found = rollouts(side, trial, channels, options);
        residuals.push(match (found, residuals.first()) {
            // Not the nominal: what blows up predicts nothing, and is refused.
            (Err(GapError::NominalDiverges { .. }), Some(nominal)) => {
                let nowhere = |of: &RolloutResiduals| vec![f64::INFINITY; of.1.len()];
                let all = nominal.iter();
                all.map(|of| (of.0.clone(), nowhere(of))).collect()
            }
            (found, _) => found?,
        });
    }
    let mut sums: Sums = vec![vec![[0.0; 5]; width]; options.verify.horizons.len()];
    let mut regimes = [vec![[0.0; 5]; width], vec![[0.0; 5]; width]];
    let middle = middle_command(trial);
    // After a rollout that blew up there is no error to take.
    let at_most = |value: f64, a: f64| {
        if value.is_finite() {
            value
        } else {
            options.verify.diverged_error * a.abs().max(1.0)
        }
    };
    for (number, (rows, a)) in residuals[0].iter().enumerate() {
        let b = &residuals[1][number].1;
        let alone = residuals.get(2).map(|of| &of[number].1);
        let start = trial.times[rows.start];
        if start < from {
            continue;
        }
        for (at, row) in rows.clone().enumerate() {
            let since = trial.times[row] - start;
            for channel in 0..width {
                let place = at * width + channel;
                let a = a[place];
                if !a.is_finite() {
                    continue;
                }
                let b = at_most(b[place], a);
                let alone = alone.map_or(0.0, |of| at_most(of[place], a));
                let about_mean = deviation(trial, channels, row, channel, means);
                let terms = [a * a, b * b, about_mean * about_mean, 1.0, alone * alone];
                for (horizon, sums) in options.verify.horizons.iter().zip(&mut sums) {
                    if since <= horizon + 1e-9 {
                        acceptance::add(&mut sums[channel], terms);
                    }
                }
                let fast = usize::from(command(trial, row) > middle);
                acceptance::add(&mut regimes[fast][channel], terms);
            }
        }
    }
    let overlays = if shown {
        overlays(trial, channels, &residuals)
    } else {
        Vec::new()
    };
    Ok(TrialErrors {
        sums,
        regimes,
        overlays,
    })
}

/// A patched model may have a longer state than the log's: the log's is left out there, and starts are
/// read off the sensors.
fn adapted(trial: &MeasuredTrial, before: &dyn Plant, plant: &dyn Plant) -> Option<MeasuredTrial> {
    (plant.description().state_len != before.description().state_len).then(|| MeasuredTrial {
        name: trial.name.clone(),
        times: trial.times.clone(),
        values: trial.values.clone(),
        width: trial.width,
        control: trial.control.clone(),
        initial_state: None,
        prescribed: trial.prescribed.as_ref().and_then(|motion| {
            let joints = &plant.description().joints;
            let place = |name: &str| {
                let joint = joints.iter().find(|joint| joint.name == name)?;
                Some((joint.qpos, joint.dof))
            };
            motion.placed(place).map(Arc::new)
        }),
        steady: trial.steady,
        deviations: trial.deviations.clone(),
    })
}

/// Residuals of the longest rollouts, one after the other.
fn rollouts(
    side: &CorrectedSystem<'_>,
    trial: &MeasuredTrial,
    channels: &Channels,
    options: &Options,
) -> Result<Vec<RolloutResiduals>, GapError> {
    let (model, corrections) = (side.system.model(), &side.corrections);
    let motion =
        state_estimation::estimate_motion(&side.system, trial, channels, corrections, options)?;
    let [.., longest] = options.verify.horizons;
    let SegmentOptions {
        joined_rest,
        least_rows,
        ..
    } = options.segments;
    let segments = segments::cut(
        trial,
        &motion,
        trial.times.len(),
        [longest, joined_rest],
        least_rows,
    );
    let mut simulation = side.system.simulation()?;
    let mut trace = Trace::default();
    let found = segments.into_iter().map(|segment| {
        let mut residual = Vec::new();
        let whole = shooting::run(
            simulation.as_mut(),
            trial,
            &segment,
            &motion,
            side.system.warm_up(&options.rollout),
            model.timestep,
            None,
            &mut trace,
        );
        if whole {
            sensor_correction::residuals(
                &trace,
                trial,
                &segment,
                channels,
                corrections,
                model.timestep,
                &mut residual,
            );
        } else {
            residual = vec![f64::INFINITY; segment.rows.len() * channels.len()];
        }
        (segment.rows, residual)
    });
    Ok(found.collect())
}

fn command(trial: &MeasuredTrial, row: usize) -> f64 {
    let mut control = vec![0.0; trial.control.width()];
    trial.control.interpolate(trial.times[row], &mut control);
    control.iter().map(|u| u * u).sum::<f64>().sqrt()
}

fn middle_command(trial: &MeasuredTrial) -> f64 {
    let mut all: Vec<f64> = (0..trial.times.len())
        .map(|row| command(trial, row))
        .collect();
    all.sort_by(f64::total_cmp);
    quantile(&all, 0.5).unwrap_or(0.0)
}

/// Measured and predicted curves for the plots of the report.
fn overlays(
    trial: &MeasuredTrial,
    channels: &Channels,
    residuals: &[Vec<RolloutResiduals>],
) -> Vec<Overlay> {
    let width = channels.len();
    let zeros = vec![0.0; width];
    channels
        .list
        .iter()
        .enumerate()
        .map(|(channel, of)| {
            let mut overlay = Overlay {
                trial: trial.name.clone(),
                sensor: of.sensor.clone(),
                component: of.component,
                unit: of.unit.clone(),
                time: Vec::new(),
                measured: Vec::new(),
                before: Vec::new(),
                after: Vec::new(),
            };
            for ((rows, a), (_, b)) in residuals[0].iter().zip(&residuals[1]) {
                for (at, row) in rows.clone().enumerate() {
                    let measured = deviation(trial, channels, row, channel, &zeros);
                    let there = measured.is_finite().then_some(measured);
                    let line = |residual: &[f64]| {
                        let value = measured - residual[at * width + channel];
                        // The first point of a rollout breaks the line.
                        (at > 0 && value.is_finite()).then_some(value)
                    };
                    overlay.time.push(trial.times[row]);
                    overlay.measured.push(there);
                    overlay.before.push(line(a));
                    overlay.after.push(line(b));
                }
            }
            overlay
        })
        .collect()
}
