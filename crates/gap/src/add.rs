//! Add: the chosen effects with their intervals, as entries of a model and corrections of sensors.

use std::collections::BTreeMap;

use hydro_effects as effects;
use hydro_effects::{Entry, Id, Part};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    bench::Bench,
    fit::{Fit, sum},
    fitted::parameters,
    name::Naming,
    stages::{Added, WithoutTrial},
    study::Study,
    verdict::{Bias, FittedParameter, SensorPatch},
};
use crate::plant::Nuisance;

/// Schema of [`Added`].
const SCHEMA: &str = "hydro-gap-add/1";
/// A number of the nominal that the fit moved by less than this part of its prior deviation stays as it is.
const MOVED: f64 = 0.01;
/// Draws of the block bootstrap.
const DRAWS: usize = 400;

/// What is to be written: entries of the model, and the stage's record (its patched model and diff are
/// filled in by who writes the file).
#[derive(Debug)]
pub struct Addition {
    /// For the file.
    pub added: Added,
    /// Effects for the patched model.
    pub entries: Vec<Entry>,
    /// Numbers of the nominal for the patched model, as the same fit has them: relative, or metres for a
    /// centre of mass. Effects and numbers were fitted together, and are right only together.
    pub numbers: Vec<(Nuisance, f64)>,
    /// Standard deviation of each number, in its unit.
    pub deviations: Vec<f64>,
}

/// The chosen effects. None where nothing was chosen.
pub fn add(study: &Study<'_>, bench: &Bench<'_>, naming: &Naming) -> Option<Addition> {
    let search = &naming.search;
    let scored = &search.scored[naming.chosen];
    if naming.named.chosen.is_empty() {
        return None;
    }
    let (entries, sensors) = split(bench, bench.entries(&scored.fit.point));
    let draws = bootstrap(study, bench, naming);
    let values = bench.nuisance_values(&scored.fit.point);
    let moved = bench.nuisances.iter().enumerate();
    let moved = moved.filter(|(_, (nuisance, prior))| values[*nuisance].abs() >= MOVED * prior);
    let (numbers, deviations) = moved
        .map(|(at, (nuisance, prior))| {
            let fitted = naming.named.nuisances.get(at);
            let deviation = fitted.map_or(*prior, |(_, _, deviation)| *deviation);
            (
                (bench.model.nuisances[*nuisance].clone(), values[*nuisance]),
                deviation,
            )
        })
        .unzip();
    Some(Addition {
        added: Added {
            schema: SCHEMA.to_owned(),
            effects: naming.named.chosen.clone(),
            sensors,
            bootstrap: draws,
            numbers: Vec::new(),
            cross_fit: cross_fit(study, bench, naming),
            recalibrated: bench.nuisance_values(&search.scored[0].fit.point),
            model: None,
            diff: String::new(),
            remarks: Vec::new(),
        },
        entries,
        numbers,
        deviations,
    })
}

/// Effects of the model, and corrections of sensors.
fn split(bench: &Bench<'_>, entries: Vec<Entry>) -> (Vec<Entry>, BTreeMap<String, SensorPatch>) {
    let (of_sensors, others): (Vec<Entry>, Vec<Entry>) = entries.into_iter().partition(|entry| {
        matches!(
            effects::catalogue::effect(entry.effect).part(),
            Part::Sensor(_)
        )
    });
    (others, sensor_patches(bench, of_sensors.iter()))
}

/// The fit without each of its trials, by the quadratics of the others about the optimum.
fn cross_fit(study: &Study<'_>, bench: &Bench<'_>, naming: &Naming) -> Vec<WithoutTrial> {
    let fit = &naming.search.scored[naming.chosen].fit;
    let trials: Vec<usize> = (0..study.trials.len())
        .filter(|trial| bench.segments.iter().any(|segment| segment.trial == *trial))
        .collect();
    if trials.len() < 2 {
        return Vec::new();
    }
    let factor = naming.search.factor;
    // The fit without a trial, and the log density that it gives to that trial: what all trials say together
    // less what the others say. How uncertain the fit is without the trial is paid for.
    let without = |fit: &Fit, all: f64, out: usize| {
        let others = fit.quadratics.iter().enumerate();
        let others = sum(others.filter(|(at, _)| *at != out).map(|(_, of)| of)).tempered(factor);
        let (of_others, best) = others.evidence(&fit.bounds)?;
        let mut point = fit.point.clone();
        bench.set(&mut point, &best.z);
        Some((point, all - of_others))
    };
    let empty = &naming.search.scored[0].fit;
    let (Some((all, _)), Some((all_alone, _))) = (fit.evidence(factor), empty.evidence(factor))
    else {
        return Vec::new();
    };
    (0..trials.len())
        .filter_map(|out| {
            let (point, density) = without(fit, all, out)?;
            let (nominal, alone) = without(empty, all_alone, out)?;
            Some(WithoutTrial {
                trial: study.trials[trials[out]].name.clone(),
                nuisances: bench.nuisance_values(&point),
                effects: bench
                    .entries(&point)
                    .into_iter()
                    .map(|entry| (entry.effect, entry.target, entry.parameters))
                    .collect(),
                recalibrated: bench.nuisance_values(&nominal),
                gain: density - alone,
            })
        })
        .collect()
}

/// Corrections by sensor, as `patch.sensors` has them.
fn sensor_patches<'e>(
    bench: &Bench<'_>,
    entries: impl Iterator<Item = &'e Entry>,
) -> BTreeMap<String, SensorPatch> {
    let mut patches: BTreeMap<String, SensorPatch> = BTreeMap::new();
    for entry in entries {
        let Part::Sensor(part) = effects::catalogue::effect(entry.effect).part() else {
            continue;
        };
        let mut sources = bench.channels.sources.iter();
        let source = sources.find(|of| bench.model.sensors[of.sensor].name == entry.target);
        let components = source.map_or(1, |source| source.channels);
        let patch = patches
            .entry(entry.target.clone())
            .or_insert_with(|| SensorPatch::none(components));
        let values = &entry.parameters;
        match entry.effect {
            Id::SensorScale => patch.scale = part.scale(values),
            Id::SensorDelay => patch.delay = part.delay(values),
            _ => {
                let component = |component| part.bias(values, component);
                patch.bias = Bias::of((0..components).map(component).collect());
            }
        }
    }
    patches
}

/// Intervals from trials drawn again with replacement; the linearisation at the optimum is kept. A value that its bound
/// holds in every draw has no spread here.
fn bootstrap(
    study: &Study<'_>,
    bench: &Bench<'_>,
    naming: &Naming,
) -> Vec<(Id, String, Vec<FittedParameter>)> {
    let search = &naming.search;
    let fit = &search.scored[naming.chosen].fit;
    let trials = fit.quadratics.len();
    if trials < 2 {
        return Vec::new();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(study.settings.seed);
    let draws: Vec<_> = (0..DRAWS)
        .filter_map(|_| {
            let drawn: Vec<usize> = (0..trials).map(|_| rng.random_range(0..trials)).collect();
            let quadratic = sum(drawn.iter().map(|at| &fit.quadratics[*at]));
            quadratic.tempered(search.factor).best(&fit.bounds)
        })
        .map(|optimum| optimum.z)
        .collect();
    let mut at = bench.nuisances.len();
    let mut intervals = Vec::new();
    for candidate in &fit.point.candidates {
        let of = &bench.candidates[*candidate];
        let mut fitted = parameters(bench, fit, *candidate, search.factor);
        for (p, fitted) in of.parameters.iter().zip(&mut fitted) {
            let mut values: Vec<f64> = draws.iter().map(|z| p.null + z[at] * p.prior_sd).collect();
            values.sort_by(f64::total_cmp);
            if let (Some(low), Some(high)) = (quantile(&values, 0.025), quantile(&values, 0.975)) {
                fitted.ci95 = [low, high];
            }
            at += 1;
        }
        for target in &of.targets {
            intervals.push((of.effect, target.clone(), fitted.clone()));
        }
    }
    intervals
}

/// A quantile of ascending values.
pub(super) fn quantile(ascending: &[f64], part: f64) -> Option<f64> {
    let last = ascending.len().checked_sub(1)?;
    let place = part * last as f64;
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    let weight = place - low as f64;
    Some(ascending[low] * (1.0 - weight) + ascending[high] * weight)
}
