//! Learning the wrench: the components that can be predicted, the attitude's encoding, and the skill.

use std::{collections::BTreeMap, sync::atomic::AtomicBool};

use hydro_model::{AttentionOdeConfig, Encoding, ModelConfig, checkpoint::Checkpoint};
use serde_json::json;

use super::data::{LEAST_SAMPLES, ResidualData, SAMPLES, Splits, splits, stands_out};
use crate::{
    TrainError,
    dataset::{self, Manifest, Split},
    metrics::{InitialForce, predict},
    trainer::{Observer, TrainConfig, TrainOutcome, TrainProgress, Trainer},
};

/// Components of a wrench and their units.
const COMPONENTS: [(&str, &str); 6] = [
    ("force.x", "N"),
    ("force.y", "N"),
    ("force.z", "N"),
    ("torque.x", "N m"),
    ("torque.y", "N m"),
    ("torque.z", "N m"),
];

/// Part of a component's mean square that must be predicted on the validation trials, and of all
/// components together.
const SKILL: f64 = 0.05;
const POOLED_SKILL: f64 = 0.1;
/// A skill beyond which no other attitude is tried, and by how much the heading must improve a smaller one.
const GOOD: f64 = 0.9;
const HEADING: f64 = 0.03;

/// Times that components are left out.
const ROUNDS: usize = 3;
/// Steps of a run, about, and bounds of its epochs.
const STEPS: usize = 2000;
const EPOCHS: [usize; 2] = [20, 400];

/// Result of learning a residual.
#[derive(Clone, Debug)]
pub enum LearnedResidual {
    /// A model that predicts the wrench of trials it was not trained on.
    Model {
        /// The model; its card says that it is a residual.
        checkpoint: Box<Checkpoint>,
        /// Part of the wrench's mean square that it predicts on them, 0 to 1.
        skill: f64,
    },
    /// No model worth using, with the reason.
    NotOffered(String),
    /// The flag was set.
    Cancelled,
}

/// Learns the wrench, in a folder of its own that is removed at the end. `tell` hears of steps done and
/// steps at most.
///
/// # Errors
/// A data set or a run that cannot be written, a loss that is no number.
pub fn learn_residual(
    data: &ResidualData,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
) -> Result<LearnedResidual, TrainError> {
    let mut axes: Vec<usize> = (0..6).filter(|axis| stands_out(data, *axis)).collect();
    if axes.is_empty() {
        return Ok(LearnedResidual::NotOffered(
            "the missing wrench does not stand out from its own error, so no learned residual is offered"
                .to_owned(),
        ));
    }
    let mut last = 0.0;
    // A component that cannot be predicted is left out, and the others are learned without it.
    for _ in 0..ROUNDS {
        let Some(splits) = splits(data, &axes) else {
            return Ok(LearnedResidual::NotOffered(format!(
                "the missing wrench is known for less than {:.1} s a trial, so no learned residual is \
                 offered",
                2.0 * LEAST_SAMPLES as f64 * data.sample_period
            )));
        };
        let Some(found) = best(data, &axes, &splits, cancel, tell)? else {
            return Ok(LearnedResidual::Cancelled);
        };
        let kept: Vec<usize> = axes
            .iter()
            .zip(&found.skills)
            .filter(|(_, skill)| **skill >= SKILL)
            .map(|(axis, _)| *axis)
            .collect();
        last = found.pooled;
        if kept.len() == axes.len() && found.pooled >= POOLED_SKILL {
            return Ok(LearnedResidual::Model {
                skill: found.pooled,
                checkpoint: Box::new(found.checkpoint),
            });
        }
        if kept.is_empty() || kept.len() == axes.len() {
            break;
        }
        axes = kept;
    }
    Ok(LearnedResidual::NotOffered(format!(
        "on trials that it was not trained on, a learned wrench predicts {:.0} % of the missing one's mean \
         square, hardly better than none; no learned residual is offered",
        100.0 * last.max(0.0)
    )))
}

/// A trained model and how it does on the validation trials.
struct Trained {
    checkpoint: Checkpoint,
    /// Part of the mean square that is predicted, by component; negative where none would be better.
    skills: Vec<f64>,
    /// Mean of `skills`.
    pooled: f64,
}

/// Tells of the steps.
struct Steps<'a>(&'a dyn Fn(usize, usize));

impl Observer for Steps<'_> {
    fn step(&mut self, progress: &TrainProgress) {
        (self.0)(progress.step, progress.steps);
    }
}

/// Water knows no heading, but what is missing may (a tether, a tilted sensor): the whole attitude is taken
/// where it predicts better. None where the flag was set.
fn best(
    data: &ResidualData,
    axes: &[usize],
    splits: &Splits,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
) -> Result<Option<Trained>, TrainError> {
    let Some(plain) = train(data, axes, splits, Encoding::Up, cancel, tell)? else {
        return Ok(None);
    };
    if plain.pooled > GOOD {
        return Ok(Some(plain));
    }
    let Some(whole) = train(data, axes, splits, Encoding::Raw, cancel, tell)? else {
        return Ok(None);
    };
    let better = whole.pooled > plain.pooled + HEADING;
    Ok(Some(if better { whole } else { plain }))
}

/// `None` if the flag was set.
fn train(
    given: &ResidualData,
    axes: &[usize],
    splits: &Splits,
    encoding: Encoding,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
) -> Result<Option<Trained>, TrainError> {
    let place = tempfile::tempdir().map_err(|source| TrainError::Io {
        path: std::env::temp_dir(),
        source,
    })?;
    let folder = place.path();
    let about = manifest(given, axes, splits.samples);
    let parts = [
        ("train", splits.train.clone()),
        ("val", splits.validation.clone()),
    ];
    let data = dataset::write(&folder.join("data"), &about, &parts)?;
    let mut config = config(given.seed, encoding);
    let per_epoch = Trainer::new(config.clone(), &data)?.steps() / config.epochs;
    config.epochs = (STEPS / per_epoch.max(1)).clamp(EPOCHS[0], EPOCHS[1]);
    config.patience = (config.epochs / 4).max(10);
    let mut trainer = Trainer::new(config, &data)?;
    if trainer.run(&folder.join("run"), cancel, &mut Steps(tell))? == TrainOutcome::Cancelled {
        return Ok(None);
    }
    let mut checkpoint = trainer.checkpoint("residual", &given.command)?;
    checkpoint.card.residual = true;
    let skills = skills(&checkpoint, &data.split("val", None)?)?;
    let pooled = skills.iter().sum::<f64>() / skills.len() as f64;
    let by_component: BTreeMap<&str, f64> = axes
        .iter()
        .map(|axis| COMPONENTS[*axis].0)
        .zip(skills.iter().copied())
        .collect();
    checkpoint.card.metrics = json!({
        "validation": {"predicted_part_of_mean_square": by_component, "pooled": pooled},
    });
    Ok(Some(Trained {
        checkpoint,
        skills,
        pooled,
    }))
}

fn manifest(data: &ResidualData, axes: &[usize], samples: usize) -> Manifest {
    let of = |which: fn(&(&str, &str)) -> String| {
        axes.iter().map(|axis| which(&COMPONENTS[*axis])).collect()
    };
    let frames = [
        ("wrench", "base, about its origin"),
        ("quaternion", "world_from_base, w x y z"),
        ("angular_velocity", "base"),
        ("linear_velocity", "base, relative to the water"),
    ];
    Manifest {
        schema: dataset::SCHEMA.to_owned(),
        name: "residual".to_owned(),
        features: data.features.clone(),
        feature_units: data.feature_units.clone(),
        outputs: of(|(name, _)| (*name).to_owned()),
        output_units: of(|(_, unit)| (*unit).to_owned()),
        frames: frames
            .into_iter()
            .map(|(vector, frame)| (vector.to_owned(), frame.to_owned()))
            .collect(),
        sample_period: data.sample_period,
        samples,
        kinematics: None,
        generalised: None,
        water: None,
        added_mass: Vec::new(),
        splits: BTreeMap::new(),
        provenance: BTreeMap::from([("seed".to_owned(), json!(data.seed))]),
    }
}

/// The released kind of model, of a size that a few trials can feed.
fn config(seed: u64, encoding: Encoding) -> TrainConfig {
    TrainConfig {
        model: ModelConfig::AttentionOde(AttentionOdeConfig {
            window: 8,
            heads: 2,
            embedding: 16,
            latent: 16,
            hidden: vec![32; 2],
            encoding,
            ..AttentionOdeConfig::default()
        }),
        seed,
        epochs: 1,
        batch: 16,
        horizon: SAMPLES / 2,
        cold_start: 0.2,
        weight_decay: 0.1,
        ..TrainConfig::default()
    }
}

/// Part of the mean square of every component that is predicted as a plugin predicts it: from the first
/// sample on, with no force given.
fn skills(checkpoint: &Checkpoint, split: &Split) -> Result<Vec<f64>, TrainError> {
    let model = checkpoint.model(None)?;
    let f = split.outputs();
    let mut sums = vec![[0.0; 2]; f];
    for trajectory in 0..split.len() {
        let predicted = predict(&model, split, trajectory, InitialForce::Estimate)?;
        for (at, (predicted, wrench)) in predicted.iter().zip(split.wrench(trajectory)).enumerate()
        {
            let (wrench, error) = (f64::from(*wrench), f64::from(wrench - predicted));
            sums[at % f][0] += error * error;
            sums[at % f][1] += wrench * wrench;
        }
    }
    let skill = |[error, zero]: [f64; 2]| 1.0 - error / zero.max(f64::MIN_POSITIVE);
    Ok(sums.into_iter().map(skill).collect())
}

#[cfg(test)]
#[path = "tests/learn.rs"]
mod tests;
