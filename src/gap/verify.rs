//! Verify: open-loop rollouts of the nominal and of the patched model, as loaded from disk, on trials that
//! nobody fitted.
//!
//! With few trials those that were fitted count too, each under a fit that left it out (a cross-fit).
//!
//! Each model starts from its own estimate of the state over a short window at the start of a rollout, and
//! is led through the motion before it, so that neither pays for the other's memory.

use std::{collections::BTreeMap, ops::Range, sync::atomic::AtomicUsize};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{
    add::quantile,
    error::GapError,
    measured::{Channels, Measured, deviation, means},
    noise,
    shooting::{self, Correction, Trace},
    stages::{Channel, Horizon, Overlay, Verified, WithoutTrial},
    start,
    study::{LEAST_ROWS, Settings},
    system::System,
    verdict::{Bias, Gap, SensorGap, SensorPatch},
    watch::Watch,
};
use crate::{
    effects::Entry,
    sim::plant::{Plant, PlantDescription},
    trial::Trial,
};

/// Schema of [`Verified`].
const SCHEMA: &str = "hydro-gap-verify/1";
/// Lengths of the rollouts [s].
const HORIZONS: [f64; 3] = [0.5, 1.0, 2.0];
/// Draws of the bootstrap over trials.
const DRAWS: usize = 1000;
/// Nothing may get worse by more than this, with 95 % confidence.
const HARM: f64 = 0.02;
/// Trials and sensors drawn in the report.
const SHOWN: usize = 3;

/// Sums of squares of one channel: before, after, measured about its mean, readings, and the nominal with its
/// numbers refitted and nothing added.
type Terms = [f64; 5];

/// Of one trial: by horizon, channel.
type Sums = Vec<Vec<Terms>>;

/// Residuals of the rows of one rollout.
type Rollout = (Range<usize>, Vec<f64>);

/// Rollouts of one trial.
struct Outcome {
    sums: Sums,
    /// The same at the longest horizon, by regime: slow, fast.
    regimes: [Vec<Terms>; 2],
    overlays: Vec<Overlay>,
}

/// What is examined.
#[derive(Clone, Copy)]
pub struct Examined<'a> {
    /// The nominal.
    pub before: &'a dyn Plant,
    /// The patched model, as loaded from disk.
    pub after: &'a dyn Plant,
    /// Corrections of sensors that go with it.
    pub sensors: &'a BTreeMap<String, SensorPatch>,
    /// Fits that left one trial out, for the trials of `fitted`.
    pub cross_fit: &'a [WithoutTrial],
    /// Numbers of the nominal as they are fitted where nothing is added; empty: not known.
    pub recalibrated: &'a [f64],
}

impl std::fmt::Debug for Examined<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Examined").finish_non_exhaustive()
    }
}

/// Compares the nominal with the patched model on trials that nobody fitted, and, for a cross-fit, with
/// the fit that left a trial out on each of the `fitted`.
///
/// # Errors
/// A model that blows up while a start is estimated, nothing to compare, a stop that was asked for.
pub fn verify(
    examined: &Examined<'_>,
    held_out: Vec<Trial>,
    fitted: Vec<Trial>,
    noise_of: &[Channel],
    settings: &Settings,
    watch: &Watch<'_>,
) -> Result<Verified, GapError> {
    let model = examined.before.description();
    let files = held_out.len();
    let trials: Vec<Measured> = held_out
        .into_iter()
        .chain(fitted)
        .map(|trial| Measured::new(trial, model))
        .collect();
    let mut channels = Channels::of(model, &trials);
    noise::estimate(&mut channels, &trials);
    for channel in &mut channels.list {
        let known = noise_of
            .iter()
            .find(|of| of.sensor == channel.sensor && of.component == channel.component);
        if let Some(known) = known {
            channel.noise = known.noise;
        }
    }
    let done = AtomicUsize::new(0);
    let outcomes = trials
        .par_iter()
        .enumerate()
        .map(|(at, trial)| {
            watch.check()?;
            let before = Side {
                system: System::plain(examined.before),
                corrections: vec![Correction::NONE; model.sensors.len()],
            };
            let after = if at < files {
                Some(Side {
                    system: System::plain(examined.after),
                    corrections: corrections(model, examined.sensors),
                })
            } else {
                let mut fits = examined.cross_fit.iter();
                fits.find(|fit| fit.trial == trial.name)
                    .map(|fit| left_out(examined.before, fit))
            };
            let Some(after) = after else {
                return Ok(None);
            };
            let alone = (!examined.recalibrated.is_empty()).then(|| Side {
                system: System {
                    knobs: examined.recalibrated.to_vec(),
                    ..System::plain(examined.before)
                },
                corrections: before.corrections.clone(),
            });
            let mut sides = vec![&before, &after];
            sides.extend(&alone);
            let outcome = roll(&sides, trial, &channels, at < SHOWN)?;
            watch.count("verifying", &done, trials.len());
            Ok(Some(outcome))
        })
        .collect::<Result<Vec<Option<Outcome>>, GapError>>()?;
    let outcomes: Vec<Outcome> = outcomes.into_iter().flatten().collect();
    let has_alone = !examined.recalibrated.is_empty();
    Ok(summary(
        &channels,
        outcomes,
        files,
        has_alone,
        settings.seed,
    ))
}

/// A model and the corrections of its sensors.
struct Side<'a> {
    system: System<'a>,
    corrections: Vec<Correction>,
}

fn left_out<'a>(plant: &'a dyn Plant, fit: &WithoutTrial) -> Side<'a> {
    let entries: Vec<Entry> = fit
        .effects
        .iter()
        .map(|(effect, target, values)| Entry {
            effect: *effect,
            target: target.clone(),
            parameters: values.clone(),
        })
        .collect();
    Side {
        corrections: shooting::corrections(plant.description(), &entries),
        system: System {
            plant,
            knobs: fit.knobs.clone(),
            entries,
        },
    }
}

/// Those that a verdict names.
fn corrections(
    model: &PlantDescription,
    sensors: &BTreeMap<String, SensorPatch>,
) -> Vec<Correction> {
    let mut corrections = vec![Correction::NONE; model.sensors.len()];
    for (sensor, correction) in model.sensors.iter().zip(&mut corrections) {
        if let Some(patch) = sensors.get(&sensor.name) {
            correction.scale = patch.scale.unwrap_or(1.0);
            correction.delay = patch.delay.unwrap_or(0.0);
            match &patch.bias {
                Some(Bias::Scalar(bias)) => correction.bias = [*bias; 3],
                Some(Bias::Vector(biases)) => {
                    for (value, bias) in correction.bias.iter_mut().zip(biases) {
                        *value = *bias;
                    }
                }
                None => {}
            }
        }
    }
    corrections
}

/// Before, after, and where it is known the nominal refitted.
fn roll(
    sides: &[&Side<'_>],
    trial: &Measured,
    channels: &Channels,
    shown: bool,
) -> Result<Outcome, GapError> {
    let width = channels.len();
    let mut residuals: Vec<Vec<Rollout>> = Vec::new();
    for side in sides {
        let mapped = adapted(trial, sides[0].system.plant, side.system.plant);
        let trial = mapped.as_ref().unwrap_or(trial);
        residuals.push(rollouts(side, trial, channels)?);
    }
    let mut sums: Sums = vec![vec![[0.0; 5]; width]; HORIZONS.len()];
    let mut regimes = [vec![[0.0; 5]; width], vec![[0.0; 5]; width]];
    let means = means(trial, channels);
    let middle = middle_command(trial);
    // A rollout that blew up where the nominal did not is as wrong as can be.
    let at_most = |value: f64, a: f64| {
        if value.is_finite() {
            value
        } else {
            1e3 * a.abs().max(1.0)
        }
    };
    for (number, (rows, a)) in residuals[0].iter().enumerate() {
        let b = &residuals[1][number].1;
        let alone = residuals.get(2).map(|of| &of[number].1);
        let start = trial.times[rows.start];
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
                let about_mean = deviation(trial, channels, row, channel, &means);
                let terms = [a * a, b * b, about_mean * about_mean, 1.0, alone * alone];
                for (horizon, sums) in HORIZONS.iter().zip(&mut sums) {
                    if since <= horizon + 1e-9 {
                        add(&mut sums[channel], terms);
                    }
                }
                let fast = usize::from(command(trial, row) > middle);
                add(&mut regimes[fast][channel], terms);
            }
        }
    }
    let overlays = if shown {
        overlays(trial, channels, &residuals)
    } else {
        Vec::new()
    };
    Ok(Outcome {
        sums,
        regimes,
        overlays,
    })
}

fn add(sum: &mut Terms, terms: Terms) {
    sum.iter_mut()
        .zip(terms)
        .for_each(|(sum, term)| *sum += term);
}

/// A patched model may have a longer state than the log's: the log's is left out there, and starts are
/// read off the sensors.
fn adapted(trial: &Measured, before: &dyn Plant, plant: &dyn Plant) -> Option<Measured> {
    (plant.description().state_len != before.description().state_len).then(|| Measured {
        name: trial.name.clone(),
        times: trial.times.clone(),
        values: trial.values.clone(),
        width: trial.width,
        control: trial.control.clone(),
        initial_state: None,
    })
}

/// Residuals of the longest rollouts, one after the other.
fn rollouts(
    side: &Side<'_>,
    trial: &Measured,
    channels: &Channels,
) -> Result<Vec<Rollout>, GapError> {
    let (model, corrections) = (side.system.model(), &side.corrections);
    let track = start::track(&side.system, trial, channels, corrections)?;
    let longest = HORIZONS[HORIZONS.len() - 1];
    let segments = shooting::cut(0, trial, &track, longest, LEAST_ROWS);
    let mut simulation = side.system.simulation()?;
    let mut trace = Trace::default();
    let found = segments.into_iter().map(|segment| {
        let mut residual = Vec::new();
        let whole = shooting::run(
            simulation.as_mut(),
            trial,
            &segment,
            &track,
            side.system.warm_up(),
            model.timestep,
            None,
            &mut trace,
        );
        if whole {
            shooting::residuals(
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

fn command(trial: &Measured, row: usize) -> f64 {
    let mut control = vec![0.0; trial.control.width()];
    trial.control.interpolate(trial.times[row], &mut control);
    control.iter().map(|u| u * u).sum::<f64>().sqrt()
}

fn middle_command(trial: &Measured) -> f64 {
    let mut all: Vec<f64> = (0..trial.times.len())
        .map(|row| command(trial, row))
        .collect();
    all.sort_by(f64::total_cmp);
    quantile(&all, 0.5).unwrap_or(0.0)
}

/// Squared error of a channel, noise taken out, over the spread of the measurement.
fn normalised(sums: Terms, side: usize, noise: f64) -> Option<f64> {
    let [_, _, spread, count, _] = sums;
    if count < 2.0 || spread <= 0.0 {
        return None;
    }
    let variance = spread / count;
    // A channel that hardly moves is measured against its noise.
    let scale = variance.max(noise * noise);
    Some(((sums[side] / count - noise * noise) / scale).max(0.0))
}

/// Root of the mean of the normalised squared errors of some channels.
fn nrmse(sums: &[Terms], channels: &Channels, side: usize, of: &dyn Fn(usize) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (channel, sums) in sums.iter().enumerate().filter(|(channel, _)| of(*channel)) {
        if let Some(value) = normalised(*sums, side, channels.list[channel].noise) {
            sum += value;
            count += 1;
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Sum over drawn trials.
fn total<'a>(drawn: impl Iterator<Item = &'a Vec<Terms>>, width: usize) -> Vec<Terms> {
    let mut sums = vec![[0.0; 5]; width];
    for of in drawn {
        for (sum, terms) in sums.iter_mut().zip(of) {
            add(sum, *terms);
        }
    }
    sums
}

fn reduction(before: f64, after: f64) -> f64 {
    if before <= 0.0 {
        0.0
    } else {
        1.0 - after / before
    }
}

/// Draws of trials with replacement, the same for every figure.
fn draws(trials: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..DRAWS)
        .map(|_| (0..trials).map(|_| rng.random_range(0..trials)).collect())
        .collect()
}

/// 95 % interval of a figure over the draws.
fn interval(draws: &[Vec<usize>], figure: &dyn Fn(&[usize]) -> f64) -> [f64; 2] {
    let mut values: Vec<f64> = draws.iter().map(|draw| figure(draw)).collect();
    values.sort_by(f64::total_cmp);
    [
        quantile(&values, 0.025).unwrap_or(f64::NAN),
        quantile(&values, 0.975).unwrap_or(f64::NAN),
    ]
}

/// `files`: so many of the outcomes, the first, are replays of the patched file.
fn summary(
    channels: &Channels,
    outcomes: Vec<Outcome>,
    files: usize,
    has_alone: bool,
    seed: u64,
) -> Verified {
    let width = channels.len();
    let draws = draws(outcomes.len(), seed);
    let everyone: Vec<usize> = (0..outcomes.len()).collect();
    let sums = |draw: &[usize], horizon: usize| {
        total(draw.iter().map(|at| &outcomes[*at].sums[horizon]), width)
    };
    let all = |_: usize| true;
    // Pooled over the horizons, as each says something of its own.
    let pooled = |draw: &[usize], side: usize, of: &dyn Fn(usize) -> bool| -> f64 {
        let squares: f64 = (0..HORIZONS.len())
            .map(|horizon| nrmse(&sums(draw, horizon), channels, side, of).powi(2))
            .sum();
        (squares / HORIZONS.len() as f64).sqrt()
    };
    let change = |draw: &[usize], of: &dyn Fn(usize) -> bool| {
        reduction(pooled(draw, 0, of), pooled(draw, 1, of))
    };
    let mut per_sensor = BTreeMap::new();
    let mut worse = Vec::new();
    for source in &channels.sources {
        let mine =
            |channel: usize| (source.channel..source.channel + source.channels).contains(&channel);
        let (before, after) = (pooled(&everyone, 0, &mine), pooled(&everyone, 1, &mine));
        let ci95 = interval(&draws, &|draw| change(draw, &mine));
        let name = channels.list[source.channel].sensor.clone();
        // Harm is judged with the noise left in: below it nobody sees a difference.
        let longest = HORIZONS.len() - 1;
        let raw = |draw: &[usize]| growth(&sums(draw, longest), &mine, 0, 1);
        if outcomes.len() > 1 && interval(&draws, &raw)[0] > HARM {
            worse.push(format!("sensor `{name}`"));
        }
        per_sensor.insert(
            name,
            SensorGap {
                before,
                after,
                reduction: reduction(before, after),
                ci95,
            },
        );
    }
    for (regime, name) in ["weak commands", "strong commands"].into_iter().enumerate() {
        let raw = |draw: &[usize]| {
            let drawn = draw.iter().map(|at| &outcomes[*at].regimes[regime]);
            growth(&total(drawn, width), &all, 0, 1)
        };
        if outcomes.len() > 1 && interval(&draws, &raw)[0] > HARM {
            worse.push(format!("the regime of {name}"));
        }
    }
    let horizons = HORIZONS
        .iter()
        .enumerate()
        .map(|(at, seconds)| {
            let side = |draw: &[usize], side: usize| nrmse(&sums(draw, at), channels, side, &all);
            Horizon {
                seconds: *seconds,
                before: side(&everyone, 0),
                after: side(&everyone, 1),
                ci95: interval(&draws, &|draw| reduction(side(draw, 0), side(draw, 1))),
            }
        })
        .collect();
    let (before, after) = (pooled(&everyone, 0, &all), pooled(&everyone, 1, &all));
    let recalibrated = has_alone.then(|| pooled(&everyone, 4, &all));
    let ci95 = interval(&draws, &|draw| change(draw, &all));
    // What is added has to do more than the nominal's own numbers could: twice the gain in log likelihood. That
    // the evidence on the fit trials is for it was asked before; here it must only not be against it.
    let beyond = |draw: &[usize]| -> f64 {
        let gained = sums(draw, HORIZONS.len() - 1)
            .into_iter()
            .zip(&channels.list);
        gained
            .map(|(terms, of)| (terms[4] - terms[1]) / (of.noise * of.noise))
            .sum()
    };
    let of_file: Vec<usize> = (0..files.min(outcomes.len())).collect();
    let by_file = change(&of_file, &all);
    let refused_because = if outcomes.len() < 2 {
        Some(format!(
            "{} held-out trial: no interval over trials can be given, so no reduction is claimed",
            outcomes.len()
        ))
    } else if ci95[0] <= 0.0 {
        Some(format!(
            "the reduction on held-out trials is {:.0} % with a 95 % interval from {:.0} % to {:.0} %, \
             which does not exclude none",
            100.0 * reduction(before, after),
            100.0 * ci95[0],
            100.0 * ci95[1]
        ))
    } else if has_alone && beyond(&everyone) <= 0.0 {
        Some(
            "refitting the nominal's numbers alone does as well on held-out trials, so the addition itself is \
             not confirmed"
                .to_owned(),
        )
    } else if by_file <= 0.0 {
        Some(format!(
            "the patched file itself reduces the error on the {files} trials that nothing saw before by {:.0} %",
            100.0 * by_file
        ))
    } else if !worse.is_empty() {
        Some(format!(
            "{} gets worse by more than {:.0} % on held-out trials",
            worse.join(", "),
            100.0 * HARM
        ))
    } else {
        None
    };
    Verified {
        schema: SCHEMA.to_owned(),
        gap: Gap {
            metric: "nrmse".to_owned(),
            before: Some(before),
            after: Some(after),
            reduction: Some(reduction(before, after)),
            ci95: (outcomes.len() > 1).then_some(ci95),
            n_holdout_trials: outcomes.len(),
            per_sensor,
        },
        horizons,
        accepted: refused_because.is_none(),
        refused_because,
        recalibrated,
        cross_fitted: outcomes.len() > files,
        remarks: cross_fit_remark(outcomes.len(), files),
        overlays: outcomes.into_iter().flat_map(|of| of.overlays).collect(),
    }
}

/// How the figures came about, where not every trial was unseen.
fn cross_fit_remark(trials: usize, files: usize) -> Vec<String> {
    if trials <= files {
        return Vec::new();
    }
    vec![format!(
        "with {trials} trials every one is judged by a fit that left it out: {files} by the patched file, which \
         nothing saw before, and {} by the same effects fitted without that trial (the effects were chosen with \
         these)",
        trials - files
    )]
}

/// Relative growth of the root mean square error of some channels from one side to another, noise left in.
fn growth(sums: &[Terms], of: &dyn Fn(usize) -> bool, from: usize, to: usize) -> f64 {
    let (mut before, mut after) = (0.0, 0.0);
    for (_, terms) in sums.iter().enumerate().filter(|(at, _)| of(*at)) {
        if terms[2] > 0.0 {
            before += terms[from] / terms[2];
            after += terms[to] / terms[2];
        }
    }
    if before <= 0.0 {
        return 0.0;
    }
    (after / before).sqrt() - 1.0
}

/// Measured and predicted, for the eye.
fn overlays(trial: &Measured, channels: &Channels, residuals: &[Vec<Rollout>]) -> Vec<Overlay> {
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
