//! The closed loop: of one checkpoint, and of the reference methods.

use std::path::Path;

use anyhow::Context as _;
use hydro_model::EngineKind;
use hydro_training::{
    comparison::{
        BOUND, ClosedLoop, ClosedLoopRow, LongRunPeaks, Method, Spread, closed_loop, long_run_peaks,
    },
    experiment::{Reference, Swimming},
};

use super::{args::Args, inputs::Inputs};
use crate::cli::{
    progress::Progress,
    references::{Scenes, fitted_drags, reference_methods},
    swim::{HORIZONS, in_plugin},
};

/// Closed loop of a checkpoint in the plugin.
pub(super) fn swim(args: &Args, inputs: &Inputs, checkpoint: &Path) -> anyhow::Result<Swimming> {
    let path = args.scenes.join("b1_swim.xml");
    let scene = hydro_files::read_text(&path, hydro_files::TEXT)
        .with_context(|| format!("reading {}", path.display()))?;
    let method = in_plugin("learned", checkpoint, EngineKind::Fused, None, &scene)?;
    let runs = inputs
        .rollouts
        .as_ref()
        .map_or(&[][..], |rollouts| &rollouts.runs);
    let swum = closed_loop(std::slice::from_ref(&method), runs, &HORIZONS, &|_| ())?;
    figures(inputs, &method, &swum, &swum.rows[0])
}

/// Closed loop of the reference methods; empty without rollouts.
pub(super) fn swim_references(args: &Args, inputs: &Inputs) -> anyhow::Result<Vec<Reference>> {
    let Some(rollouts) = &inputs.rollouts else {
        return Ok(Vec::new());
    };
    let scenes = Scenes::find(&args.scenes, rollouts)?;
    let mut laws = Vec::new();
    for data in inputs.data.values() {
        laws.extend(fitted_drags(data)?);
    }
    let methods = reference_methods(&scenes, &laws);
    let each = rollouts.runs.len() + usize::from(inputs.long.is_some());
    let progress = Progress::new("references", (methods.len() * each) as u64);
    let swum = closed_loop(&methods, &rollouts.runs, &HORIZONS, &|name| {
        progress.tick(name);
    })?;
    let mut found = Vec::new();
    for (method, row) in methods.iter().zip(&swum.rows) {
        found.push(Reference {
            label: row.name.clone(),
            swimming: figures(inputs, method, &swum, row)?,
        });
        progress.tick(&row.name);
    }
    progress.finish();
    Ok(found)
}

/// Errors of the short runs, and peaks of the long run, which is driven here.
fn figures(
    inputs: &Inputs,
    method: &Method<'_, anyhow::Error>,
    swum: &ClosedLoop,
    row: &ClosedLoopRow,
) -> anyhow::Result<Swimming> {
    let long = match inputs.long.as_ref().and_then(|long| long.runs.first()) {
        Some(run) => {
            let mut simulator = (method.simulator)(run)?;
            Some(long_run_peaks(simulator.as_mut(), &method.water, run))
        }
        None => None,
    };
    let finite = |value: f64| value.is_finite().then_some(value);
    let medians = |spreads: &[Spread]| -> Vec<_> {
        spreads.iter().map(|spread| finite(spread.median)).collect()
    };
    Ok(Swimming {
        horizons: swum.horizons.clone(),
        position: medians(&row.position),
        attitude: medians(&row.attitude),
        runs: swum.runs,
        diverged: row.diverged,
        minutes: long.as_ref().map(|bounds| bounds.duration / 60.0),
        peaks: long.as_ref().map(LongRunPeaks::ratios),
        bounded: long.as_ref().map(|bounds| bounds.within(BOUND)),
    })
}
