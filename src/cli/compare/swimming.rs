//! The closed loop of one checkpoint.

use std::{fs, path::Path};

use anyhow::Context as _;
use hydro_plugin::{
    comparison::{bounds, closed_loop},
    experiment::Swimming,
    model::EngineKind,
};

use super::{Args, Inputs};
use crate::cli::swim::{BOUND, HORIZONS, in_plugin};

pub(super) fn swim(args: &Args, inputs: &Inputs, checkpoint: &Path) -> anyhow::Result<Swimming> {
    let path = args.scenes.join("b1_swim.xml");
    let scene = fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
    let contender = in_plugin("learned", checkpoint, EngineKind::Fused, &scene)?;
    let runs = inputs
        .rollouts
        .as_ref()
        .map_or(&[][..], |rollouts| &rollouts.runs);
    let swum = closed_loop(std::slice::from_ref(&contender), runs, &HORIZONS, &|_| ())?;
    let row = &swum.rows[0];
    let finite = |value: f64| value.is_finite().then_some(value);
    let long = inputs
        .long
        .as_ref()
        .and_then(|rollouts| rollouts.runs.first());
    let long = match long {
        Some(run) => Some(bounds((contender.simulator)(run)?.as_mut(), run)),
        None => None,
    };
    Ok(Swimming {
        horizons: swum.horizons.clone(),
        position: row
            .position
            .iter()
            .map(|spread| finite(spread.median))
            .collect(),
        attitude: row
            .attitude
            .iter()
            .map(|spread| finite(spread.median))
            .collect(),
        runs: swum.runs,
        diverged: row.diverged,
        minutes: long.as_ref().map(|bounds| bounds.duration / 60.0),
        peaks: long.as_ref().map(|bounds| {
            [bounds.speed, bounds.rate, bounds.force, bounds.torque]
                .map(|peak| finite(peak.ratio()))
        }),
        bounded: long.as_ref().map(|bounds| bounds.within(BOUND)),
    })
}
