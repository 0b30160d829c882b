//! The closed loop: of one checkpoint, and of whom it is measured by.

use std::{fs, path::Path};

use anyhow::Context as _;
use hydro_plugin::{
    comparison::{ClosedLoop, Spread, bounds, closed_loop, closed_loop::Errors},
    experiment::{Reference, Swimming},
    model::EngineKind,
};

use super::{Args, Inputs};
use crate::cli::{
    progress::Progress,
    references::{Scenes, drags, references},
    swim::{BOUND, HORIZONS, in_plugin},
};

pub(super) fn swim(args: &Args, inputs: &Inputs, checkpoint: &Path) -> anyhow::Result<Swimming> {
    let path = args.scenes.join("b1_swim.xml");
    let scene = fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
    let contender = in_plugin("learned", checkpoint, EngineKind::Fused, &scene)?;
    let runs = inputs
        .rollouts
        .as_ref()
        .map_or(&[][..], |rollouts| &rollouts.runs);
    let swum = closed_loop(std::slice::from_ref(&contender), runs, &HORIZONS, &|_| ())?;
    let long = inputs
        .long
        .as_ref()
        .and_then(|rollouts| rollouts.runs.first());
    let long = match long {
        Some(run) => Some(bounds((contender.simulator)(run)?.as_mut(), run)),
        None => None,
    };
    Ok(Swimming {
        minutes: long.as_ref().map(|bounds| bounds.duration / 60.0),
        peaks: long.as_ref().map(|bounds| {
            [bounds.speed, bounds.rate, bounds.force, bounds.torque]
                .map(|peak| finite(peak.ratio()))
        }),
        bounded: long.as_ref().map(|bounds| bounds.within(BOUND)),
        ..short(&swum, &swum.rows[0])
    })
}

/// Those that are not trained, through the same runs; none without runs.
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
    let progress = Progress::new(
        "references",
        (contenders.len() * rollouts.runs.len()) as u64,
    );
    let swum = closed_loop(&contenders, &rollouts.runs, &HORIZONS, &|name| {
        progress.tick(name);
    })?;
    progress.finish();
    let rows = swum.rows.iter();
    Ok(rows
        .map(|row| Reference {
            label: row.name.clone(),
            swimming: short(&swum, row),
        })
        .collect())
}

/// A contender's figures but for the long run's.
fn short(swum: &ClosedLoop, row: &Errors) -> Swimming {
    let medians = |spreads: &[Spread]| -> Vec<Option<f64>> {
        spreads.iter().map(|spread| finite(spread.median)).collect()
    };
    Swimming {
        horizons: swum.horizons.clone(),
        position: medians(&row.position),
        attitude: medians(&row.attitude),
        runs: swum.runs,
        diverged: row.diverged,
        minutes: None,
        peaks: None,
        bounded: None,
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
