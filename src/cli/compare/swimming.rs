//! The closed loop: of one checkpoint, and of whom it is measured by.

use std::{fs, path::Path};

use anyhow::Context as _;
use hydro_model::EngineKind;
use hydro_training::{
    comparison::{
        BOUND, Bounds, ClosedLoop, Contender, Spread, bounds, closed_loop, closed_loop::Errors,
    },
    experiment::{Reference, Swimming},
};

use super::{Args, Inputs};
use crate::cli::{
    progress::Progress,
    references::{Scenes, drags, references},
    swim::{HORIZONS, in_plugin},
};

/// Of a checkpoint in the plugin.
pub(super) fn swim(args: &Args, inputs: &Inputs, checkpoint: &Path) -> anyhow::Result<Swimming> {
    let path = args.scenes.join("b1_swim.xml");
    let scene = fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
    let contender = in_plugin("learned", checkpoint, EngineKind::Fused, &scene)?;
    let runs = inputs
        .rollouts
        .as_ref()
        .map_or(&[][..], |rollouts| &rollouts.runs);
    let swum = closed_loop(std::slice::from_ref(&contender), runs, &HORIZONS, &|_| ())?;
    figures(inputs, &contender, &swum, &swum.rows[0])
}

/// Of those that are not trained; of nobody where there is nothing to swim in.
pub(super) fn swim_references(args: &Args, inputs: &Inputs) -> anyhow::Result<Vec<Reference>> {
    let Some(rollouts) = &inputs.rollouts else {
        return Ok(Vec::new());
    };
    let scenes = Scenes::of(&args.scenes, rollouts)?;
    let mut laws = Vec::new();
    for data in inputs.data.values() {
        laws.extend(drags(data)?);
    }
    let contenders = references(&scenes, &laws);
    let each = rollouts.runs.len() + usize::from(inputs.long.is_some());
    let progress = Progress::new("references", (contenders.len() * each) as u64);
    let swum = closed_loop(&contenders, &rollouts.runs, &HORIZONS, &|name| {
        progress.tick(name);
    })?;
    let mut found = Vec::new();
    for (contender, row) in contenders.iter().zip(&swum.rows) {
        found.push(Reference {
            label: row.name.clone(),
            swimming: figures(inputs, contender, &swum, row)?,
        });
        progress.tick(&row.name);
    }
    progress.finish();
    Ok(found)
}

/// What a contender did in the short runs, and what it does in the long one.
fn figures(
    inputs: &Inputs,
    contender: &Contender<'_, anyhow::Error>,
    swum: &ClosedLoop,
    row: &Errors,
) -> anyhow::Result<Swimming> {
    let long = match inputs.long.as_ref().and_then(|long| long.runs.first()) {
        Some(run) => {
            let mut simulator = (contender.simulator)(run)?;
            Some(bounds(simulator.as_mut(), &contender.water, run))
        }
        None => None,
    };
    let finite = |value: f64| value.is_finite().then_some(value);
    let medians =
        |spreads: &[Spread]| -> Vec<_> { spreads.iter().map(|of| finite(of.median)).collect() };
    Ok(Swimming {
        horizons: swum.horizons.clone(),
        position: medians(&row.position),
        attitude: medians(&row.attitude),
        runs: swum.runs,
        diverged: row.diverged,
        minutes: long.as_ref().map(|bounds| bounds.duration / 60.0),
        peaks: long.as_ref().map(Bounds::ratios),
        bounded: long.as_ref().map(|bounds| bounds.within(BOUND)),
    })
}
