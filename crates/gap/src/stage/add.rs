//! Add: the chosen effects with their intervals, as entries of a model and corrections of sensors.

use std::collections::BTreeMap;

use hydro_effects as effects;
use hydro_effects::{Entry, Part};

use crate::{
    likelihood::explanation::Explanation,
    output::{
        records::Added,
        verdict::{FittedEffect, SensorPatch},
    },
    plant::Nuisance,
    stage::{bootstrap::bootstrap, cross_fit::cross_fit, name::Naming, own_values},
};

/// Schema of [`Added`].
const SCHEMA: &str = "hydro-gap-add/1";

/// The addition to be written: entries of the model, and the stage's record (its patched model and diff are
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
pub fn add(explanation: &Explanation<'_>, naming: &Naming) -> Option<Addition> {
    let effects = naming.named.added();
    if effects.is_empty() {
        return None;
    }
    let problem = explanation.problem;
    let point = explanation.point(naming.chosen);
    // Of an effect on all joints only those on which it acts.
    let is_listed = |of: &Entry| {
        let mut effects = effects.iter();
        effects.any(|listed| (listed.effect, &listed.target) == (of.effect, &of.target))
    };
    let listed = problem.entries(&point).into_iter().filter(is_listed);
    let (entries, sensors) = split(explanation, listed.collect());
    let draws = bootstrap(explanation, naming);
    let values = problem.nuisance_values(&point);
    let moved = problem.nuisances.iter().enumerate();
    let moved = moved.filter(|(_, (nuisance, prior))| {
        values[*nuisance].abs() >= problem.settings.options.add.least_shift * prior
    });
    let (numbers, deviations) = moved
        .map(|(at, (nuisance, prior))| {
            let fitted = naming.named.nuisances.get(at);
            let deviation = fitted.map_or(*prior, |(_, _, deviation)| *deviation);
            (
                (
                    problem.model.nuisances[*nuisance].clone(),
                    values[*nuisance],
                ),
                deviation,
            )
        })
        .unzip();
    Some(Addition {
        added: Added {
            schema: SCHEMA.to_owned(),
            sensors,
            bootstrap: draws,
            numbers: Vec::new(),
            cross_fit: cross_fit(explanation, naming),
            own: own_values::of_fit(explanation, naming.chosen),
            recalibrated: explanation.recalibrated(None),
            commands_before: (problem.model.commands_before()).map_or(0.0, |at| values[at]),
            model: None,
            diff: String::new(),
            remarks: at_their_mean(&effects),
            effects,
        },
        entries,
        numbers,
        deviations,
    })
}

/// Remark on effects that differ from trial to trial.
fn at_their_mean(chosen: &[FittedEffect]) -> Vec<String> {
    let differs = |of: &&FittedEffect| of.parameters.iter().any(|p| !p.by_trial.is_empty());
    let differing: Vec<String> = (chosen.iter().filter(differs))
        .map(|of| format!("{} on `{}`", of.effect, of.target))
        .collect();
    match differing.is_empty() {
        true => Vec::new(),
        false => vec![format!(
            "{} differs from trial to trial: the patched model holds the mean; of a trial that was left out its own value is \
             estimated on the first half, and the second half is judged",
            differing.join(", ")
        )],
    }
}

/// Effects of the model, and corrections of sensors.
fn split(
    explanation: &Explanation<'_>,
    entries: Vec<Entry>,
) -> (Vec<Entry>, BTreeMap<String, SensorPatch>) {
    let (of_sensors, others): (Vec<Entry>, Vec<Entry>) = entries
        .into_iter()
        .partition(|entry| matches!(effects::effect(entry.effect).part(), Part::Sensor(_)));
    (others, sensor_patches(explanation, of_sensors.iter()))
}

/// Corrections by sensor, as `patch.sensors` has them.
fn sensor_patches<'e>(
    explanation: &Explanation<'_>,
    entries: impl Iterator<Item = &'e Entry>,
) -> BTreeMap<String, SensorPatch> {
    let mut patches: BTreeMap<String, SensorPatch> = BTreeMap::new();
    for entry in entries {
        let Part::Sensor(part) = effects::effect(entry.effect).part() else {
            continue;
        };
        let mut sources = explanation.problem.channels.sources.iter();
        let source =
            sources.find(|of| explanation.problem.model.sensors[of.sensor].name == entry.target);
        let components = source.map_or(1, |source| source.channels);
        let patch = patches
            .entry(entry.target.clone())
            .or_insert_with(|| SensorPatch::none(components));
        let values = &entry.parameters;
        patch.scale *= part.scale(values);
        patch.delay += part.delay(values);
        for component in 0..components {
            patch.bias.add(component, part.bias(values, component));
        }
    }
    patches
}

/// The nominal's uncertain numbers as they were fitted where nothing is missing, by nuisance parameter of the model: value
/// and standard deviation, zero where the fit hardly moved one.
pub fn refitted(explanation: &Explanation<'_>) -> Vec<(f64, f64)> {
    let problem = &explanation.problem;
    let mut all = vec![(0.0, 0.0); problem.model.nuisances.len()];
    let fitted = explanation.nuisances(explanation.nothing());
    for ((nuisance, prior), (_, value, deviation)) in problem.nuisances.iter().zip(fitted) {
        if value.abs() >= problem.settings.options.add.least_shift * prior {
            all[*nuisance] = (value, deviation);
        }
    }
    all
}
