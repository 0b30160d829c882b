//! A candidate model with a learned residual: a network trained on the wrench that the nominal model lacks.

use std::{cell::Cell, fs, path::Path};

use anyhow::{Context as _, bail};
use hydro_gap as gap;
use hydro_gap::{
    MissingWrench, Problem, Residual, Watch,
    patch::{self, PatchError},
    plant::{Nuisance, PlantDescription},
    records::Added,
};
use hydro_model::{
    checkpoint::Checkpoint,
    features::{Feature, FeatureLayout},
};
use hydro_plugin::plugin::{Base, Body, FeatureMap, Joint, JointKind};
use hydro_training::{LearnedResidual, RecordedWrench, ResidualData, learn_residual};

use super::{
    candidate::{Candidate, parameter_names, patched_candidate, record_refitted},
    results_folder::{RESIDUAL, RESIDUAL_FILES},
};
use crate::cli::command_line;

/// Schema of [`Added`].
const SCHEMA: &str = "hydro-gap-add/1";
/// Training steps between two reports of progress.
const TOLD: usize = 10;

/// Inputs of a candidate.
pub(super) struct Task<'a> {
    /// The nominal MJCF.
    pub(super) nominal: &'a Path,
    /// The same, compiled.
    pub(super) model: &'a PlantDescription,
    /// The folder of results, which will hold the learned residual.
    pub(super) out: &'a Path,
    pub(super) seed: u64,
    /// Uncertain numbers of the nominal as fitted, in the order of `PlantDescription::nuisances`: value, standard
    /// deviation.
    pub(super) nuisances: Vec<(f64, f64)>,
}

/// A candidate with a learned residual, or a remark why there is none.
pub(super) fn candidate(
    task: &Task<'_>,
    study: &Problem<'_>,
    watch: &Watch<'_>,
) -> anyhow::Result<Candidate> {
    let (values, deviations): (Vec<f64>, Vec<f64>) = task.nuisances.iter().copied().unzip();
    let known = task.model.nuisances.iter().cloned();
    let numbers: Vec<(Nuisance, f64)> = known.zip(values.iter().copied()).collect();
    let plain = patch::patch(&patch::Request {
        nominal: task.nominal,
        entries: &[],
        numbers: &numbers,
        description: task.model,
        names: parameter_names,
        search: &[],
    })?;
    // A value that the text cannot express stays nominal; commands before the logs are theirs.
    let mut nuisances = vec![0.0; values.len()];
    for written in &plain.numbers {
        nuisances[written.number] = values[written.number];
    }
    let before = task.model.commands_before();
    if let Some(at) = before {
        nuisances[at] = values[at];
    }
    let missing = match gap::residual(study, &nuisances, watch)? {
        Residual::Found(missing) => missing,
        Residual::NotOffered(why) => return Ok(not_offered(why)),
    };
    let (checkpoint, skill) = match learn(&missing, task.model, task.seed, watch)? {
        LearnedResidual::Model { checkpoint, skill } => (checkpoint, skill),
        LearnedResidual::NotOffered(why) => return Ok(not_offered(why)),
        LearnedResidual::Cancelled => bail!("stopped while a residual was learned"),
    };
    // An absolute path, so that the model loads from any folder.
    let folder = fs::canonicalize(task.out)
        .with_context(|| format!("--out {}", task.out.display()))?
        .join(RESIDUAL);
    let wrench = patch::CheckpointWrench {
        body: &missing.base.body,
        checkpoint: &folder,
        density: missing.base.density,
        current: missing.base.water,
    };
    let patched = match patch::add_checkpoint_wrench(plain, task.nominal, &wrench) {
        Ok(patched) => patched,
        Err(why @ (PatchError::NoBody { .. } | PatchError::LearnedTwice { .. })) => {
            return Ok(not_offered(format!(
                "{why}; no learned residual is offered"
            )));
        }
        Err(fault) => return Err(fault.into()),
    };
    let mut added = addition(&missing, skill);
    added.commands_before = before.map_or(0.0, |at| values[at]);
    let beside = "as if nothing were missing";
    record_refitted(&mut added, &patched, &numbers, &deviations, beside);
    let mut candidate = patched_candidate(task.nominal, added, patched)?;
    candidate.residual = files(&checkpoint)?;
    Ok(candidate)
}

/// Learns the missing wrench.
fn learn(
    missing: &MissingWrench,
    model: &PlantDescription,
    seed: u64,
    watch: &Watch<'_>,
) -> anyhow::Result<LearnedResidual> {
    let layout = FeatureLayout::floating_base(&missing.base.joints)?;
    let (map, units) = features(missing, model, &layout)?;
    let recorded = missing.series.iter().map(|series| {
        let mut x = Vec::with_capacity(series.times.len() * layout.len());
        let mut previous: Option<Vec<f64>> = None;
        for (qpos, qvel) in series.qpos.iter().zip(&series.qvel) {
            let mut sample = vec![0.0; layout.len()];
            map.sample(qpos, qvel, [0.0; 3], previous.as_deref(), &mut sample);
            x.extend(sample.iter().map(|value| *value as f32));
            previous = Some(sample);
        }
        RecordedWrench {
            x,
            wrench: series.wrench.clone(),
            sd: series.sd.clone(),
        }
    });
    let data = ResidualData {
        recorded: recorded.collect(),
        features: layout.clone(),
        feature_units: units,
        sample_period: missing.sample_period,
        seed,
        command: command_line(),
    };
    let told = Cell::new(0);
    let tell = |step: usize, steps: usize| {
        // A second round starts again at step zero.
        if step < told.get() || step >= told.get() + TOLD || step == steps {
            told.set(step);
            (watch.tell)("learning a residual", step, steps);
        }
    };
    Ok(learn_residual(&data, watch.stop, &tell)?)
}

/// The features as the plugin computes them, so that training and use agree; and their units.
fn features(
    missing: &MissingWrench,
    model: &PlantDescription,
    layout: &FeatureLayout,
) -> anyhow::Result<(FeatureMap, Vec<String>)> {
    let slides = |name: &String| {
        let joint = model.joints.iter().find(|joint| joint.name == *name);
        joint.is_some_and(|joint| joint.scale.slides)
    };
    let units = layout.features().iter().map(|feature| match feature {
        Feature::JointPosition(joint) if slides(joint) => "m".to_owned(),
        Feature::JointVelocity(joint) if slides(joint) => "m/s".to_owned(),
        other => other.unit().to_owned(),
    });
    let body = Body {
        name: missing.base.body.clone(),
        base: Base::Free {
            qpos: missing.base.qpos,
            dof: missing.base.dof,
        },
        joints: model
            .joints
            .iter()
            .map(|joint| Joint {
                name: joint.name.clone(),
                kind: if joint.scale.slides {
                    JointKind::Slide
                } else {
                    JointKind::Hinge
                },
                qpos: joint.qpos,
                dof: joint.dof,
            })
            .collect(),
    };
    let (density, water) = (missing.base.density, missing.base.water);
    let map = FeatureMap::new(layout, &missing.base.joints, None, &body, density, water)?;
    Ok((map, units.collect()))
}

/// The record of a candidate with a learned residual; the model's part is filled in later.
fn addition(missing: &MissingWrench, skill: f64) -> Added {
    let trials = missing.series.len();
    record(format!(
        "a learned residual on `{}`, of no name: a small network of the motion, trained on the wrench that \
         the nominal model lacks along {trials} {}; of the wrench of trials that it was not trained on it \
         predicts {:.0} % of the mean square. The model names its folder by an absolute path",
        missing.base.body,
        if trials == 1 { "trial" } else { "trials" },
        100.0 * skill
    ))
}

/// A candidate without a model, and the reason.
fn not_offered(why: String) -> Candidate {
    Candidate {
        added: record(why),
        xml: None,
        residual: Vec::new(),
    }
}

fn record(remark: String) -> Added {
    Added {
        schema: SCHEMA.to_owned(),
        effects: Vec::new(),
        sensors: [].into(),
        bootstrap: Vec::new(),
        cross_fit: Vec::new(),
        own: None,
        recalibrated: Vec::new(),
        commands_before: 0.0,
        numbers: Vec::new(),
        model: None,
        diff: String::new(),
        remarks: vec![remark],
    }
}

/// The files of a checkpoint, by name in the folder of results.
fn files(checkpoint: &Checkpoint) -> anyhow::Result<Vec<(&'static str, Vec<u8>)>> {
    let place = tempfile::tempdir().context("a folder for the learned residual")?;
    checkpoint.save(&place.path().join(RESIDUAL))?;
    RESIDUAL_FILES
        .into_iter()
        .map(|name| {
            let path = place.path().join(name);
            let bytes = hydro_files::read(&path, hydro_files::TEXT)
                .with_context(|| format!("reading {}", path.display()))?;
            Ok((name, bytes))
        })
        .collect()
}

#[cfg(test)]
mod tests;
