//! A small force model of what another model of the water lacks, from a wrench that was estimated along
//! trials.
//!
//! Trials are few and the wrench is uncertain, so the network is small, whole trials validate it, and it
//! is only worth having where it predicts their wrench better than no wrench at all does.

use std::{collections::BTreeMap, sync::atomic::AtomicBool};

use hydro_model::{
    AttentionOdeConfig, Encoding, ModelConfig, checkpoint::Checkpoint, features::FeatureLayout,
};
use serde_json::json;

use super::{InitialForce, Observer, Outcome, Progress, TrainConfig, TrainError, Trainer, predict};
use crate::dataset::{self, Manifest, Split, Trajectory};

/// Components of a wrench and their units.
const COMPONENTS: [(&str, &str); 6] = [
    ("force.x", "N"),
    ("force.y", "N"),
    ("force.z", "N"),
    ("torque.x", "N m"),
    ("torque.y", "N m"),
    ("torque.z", "N m"),
];
/// Samples of a trajectory at most, and at least.
const SAMPLES: usize = 100;
const LEAST_SAMPLES: usize = 20;
/// By how much the mean square of a component must exceed that of its error to be learned.
const STANDS_OUT: f64 = 2.0;
/// Part of the trials that validate.
const VALIDATION: f64 = 0.25;
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

/// The wrench along one trial.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Features of every sample, SI [T, n].
    pub x: Vec<f32>,
    /// Wrench of every sample [N, N m], in the base's frame about its origin [T].
    pub wrench: Vec<[f64; 6]>,
    /// Its standard deviation [T].
    pub sd: Vec<[f64; 6]>,
}

/// What is to be learned.
#[derive(Clone, Debug)]
pub struct Lesson {
    /// Columns of `x`.
    pub features: FeatureLayout,
    /// Their units.
    pub feature_units: Vec<String>,
    /// Time between samples [s].
    pub sample_period: f64,
    /// By trial.
    pub recorded: Vec<Recorded>,
    /// Of weights and order of the data.
    pub seed: u64,
    /// For the card.
    pub command: String,
}

/// What came of a lesson.
#[derive(Clone, Debug)]
pub enum Learned {
    /// A model that predicts the wrench of trials it was not trained on.
    Model {
        /// The model; its card says that it is a residual.
        checkpoint: Box<Checkpoint>,
        /// Part of the wrench's mean square that it predicts on them, 0 to 1.
        skill: f64,
    },
    /// Nothing worth having; why.
    Nothing(String),
    /// The flag was set.
    Cancelled,
}

/// Learns the wrench, in a folder of its own that is removed at the end. `tell` hears of steps done and
/// steps at most.
///
/// # Errors
/// A data set or a run that cannot be written, a loss that is no number.
pub fn learn_residual(
    lesson: &Lesson,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
) -> Result<Learned, TrainError> {
    let mut axes: Vec<usize> = (0..6).filter(|axis| stands_out(lesson, *axis)).collect();
    if axes.is_empty() {
        return Ok(Learned::Nothing(
            "the missing wrench does not stand out from its own error, so no learned residual is offered"
                .to_owned(),
        ));
    }
    let mut last = 0.0;
    // A component that cannot be predicted is left out, and the others are learned without it.
    for _ in 0..ROUNDS {
        let Some(splits) = splits(lesson, &axes) else {
            return Ok(Learned::Nothing(format!(
                "the missing wrench is known for less than {:.1} s a trial, so no learned residual is \
                 offered",
                2.0 * LEAST_SAMPLES as f64 * lesson.sample_period
            )));
        };
        let Some(found) = best(lesson, &axes, &splits, cancel, tell)? else {
            return Ok(Learned::Cancelled);
        };
        let kept: Vec<usize> = axes
            .iter()
            .zip(&found.skills)
            .filter(|(_, skill)| **skill >= SKILL)
            .map(|(axis, _)| *axis)
            .collect();
        last = found.pooled;
        if kept.len() == axes.len() && found.pooled >= POOLED_SKILL {
            return Ok(Learned::Model {
                skill: found.pooled,
                checkpoint: Box::new(found.checkpoint),
            });
        }
        if kept.is_empty() || kept.len() == axes.len() {
            break;
        }
        axes = kept;
    }
    Ok(Learned::Nothing(format!(
        "on trials that it was not trained on, a learned wrench predicts {:.0} % of the missing one's mean \
         square, hardly better than none; no learned residual is offered",
        100.0 * last.max(0.0)
    )))
}

/// True where a component is more than its own error.
fn stands_out(lesson: &Lesson, axis: usize) -> bool {
    let sum = |of: &dyn Fn(&Recorded) -> f64| lesson.recorded.iter().map(of).sum::<f64>();
    let square = |rows: &[[f64; 6]]| rows.iter().map(|row| row[axis] * row[axis]).sum::<f64>();
    let (wrench, error) = (sum(&|of| square(&of.wrench)), sum(&|of| square(&of.sd)));
    wrench > STANDS_OUT * error
}

/// Trajectories to train on and to validate with.
struct Splits {
    samples: usize,
    train: Vec<Trajectory>,
    validation: Vec<Trajectory>,
}

/// Whole trials validate; of a single one, its end does. None where nothing is long enough.
fn splits(lesson: &Lesson, axes: &[usize]) -> Option<Splits> {
    let lengths = || lesson.recorded.iter().map(|of| of.wrench.len());
    let longest = lengths().max()?;
    let alone = lesson.recorded.len() < 2;
    let whole = if alone { longest / 3 } else { longest };
    let samples = SAMPLES.min(whole);
    if samples < LEAST_SAMPLES {
        return None;
    }
    let cut: Vec<Vec<Trajectory>> = lesson
        .recorded
        .iter()
        .map(|of| trajectories(of, lesson.features.len(), axes, samples))
        .filter(|cut| !cut.is_empty())
        .collect();
    let (train, validation) = if cut.len() < 2 {
        let mut only = cut.into_iter().next()?;
        let last = ((VALIDATION * only.len() as f64).ceil() as usize).max(1);
        let validation = only.split_off(only.len().checked_sub(last)?);
        (only, validation)
    } else {
        let held = ((VALIDATION * cut.len() as f64).round() as usize).max(1);
        let mut train = cut;
        let validation = train.split_off(train.len() - held);
        (train.concat(), validation.concat())
    };
    (!train.is_empty() && !validation.is_empty()).then_some(Splits {
        samples,
        train,
        validation,
    })
}

/// A trial cut into trajectories of equal length; a short rest overlaps the one before.
fn trajectories(of: &Recorded, n: usize, axes: &[usize], samples: usize) -> Vec<Trajectory> {
    let rows = of.wrench.len();
    let Some(last) = rows.checked_sub(samples) else {
        return Vec::new();
    };
    let mut starts: Vec<usize> = (0..=last).step_by(samples).collect();
    if starts
        .last()
        .is_some_and(|start| last - start > samples / 2)
    {
        starts.push(last);
    }
    starts
        .into_iter()
        .map(|start| Trajectory {
            x: of.x[start * n..(start + samples) * n].to_vec(),
            wrench: of.wrench[start..start + samples]
                .iter()
                .flat_map(|row| axes.iter().map(|axis| row[*axis] as f32))
                .collect(),
        })
        .collect()
}

/// A trained model and how it does on the validation trials.
struct Trained {
    checkpoint: Checkpoint,
    /// Part of the mean square that is predicted, by component; negative where none would be better.
    skills: Vec<f64>,
    /// Of all components, each in parts of its own.
    pooled: f64,
}

/// Tells of the steps.
struct Steps<'a>(&'a dyn Fn(usize, usize));

impl Observer for Steps<'_> {
    fn step(&mut self, progress: &Progress) {
        (self.0)(progress.step, progress.steps);
    }
}

/// Water knows no heading, but what is missing may (a tether, a tilted sensor): the whole attitude is taken
/// where it predicts better. None where the flag was set.
fn best(
    lesson: &Lesson,
    axes: &[usize],
    splits: &Splits,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
) -> Result<Option<Trained>, TrainError> {
    let Some(plain) = train(lesson, axes, splits, Encoding::Up, cancel, tell)? else {
        return Ok(None);
    };
    if plain.pooled > GOOD {
        return Ok(Some(plain));
    }
    let Some(whole) = train(lesson, axes, splits, Encoding::Raw, cancel, tell)? else {
        return Ok(None);
    };
    let better = whole.pooled > plain.pooled + HEADING;
    Ok(Some(if better { whole } else { plain }))
}

/// None where the flag was set.
fn train(
    lesson: &Lesson,
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
    let about = manifest(lesson, axes, splits.samples);
    let parts = [
        ("train", splits.train.clone()),
        ("val", splits.validation.clone()),
    ];
    let data = dataset::write(&folder.join("data"), &about, &parts)?;
    let mut config = config(lesson.seed, encoding);
    let per_epoch = Trainer::new(config.clone(), &data)?.steps() / config.epochs;
    config.epochs = (STEPS / per_epoch.max(1)).clamp(EPOCHS[0], EPOCHS[1]);
    config.patience = (config.epochs / 4).max(10);
    let mut trainer = Trainer::new(config, &data)?;
    if trainer.run(&folder.join("run"), cancel, &mut Steps(tell))? == Outcome::Cancelled {
        return Ok(None);
    }
    let mut checkpoint = trainer.checkpoint("residual", &lesson.command)?;
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

fn manifest(lesson: &Lesson, axes: &[usize], samples: usize) -> Manifest {
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
        features: lesson.features.clone(),
        feature_units: lesson.feature_units.clone(),
        outputs: of(|(name, _)| (*name).to_owned()),
        output_units: of(|(_, unit)| (*unit).to_owned()),
        frames: frames
            .into_iter()
            .map(|(vector, frame)| (vector.to_owned(), frame.to_owned()))
            .collect(),
        sample_period: lesson.sample_period,
        samples,
        kinematics: None,
        splits: BTreeMap::new(),
        provenance: BTreeMap::from([("seed".to_owned(), json!(lesson.seed))]),
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
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Trials of a body that goes to and fro; `wrench` from speed, time and a number that is never the
    /// same.
    fn lesson(trials: usize, wrench: &dyn Fn(f64, f64) -> f64) -> Lesson {
        let features = FeatureLayout::floating_base(&[]).unwrap();
        let units = features.features().iter().map(|f| f.unit().to_owned());
        let recorded = (0..trials).map(|trial| {
            let mut of = Recorded {
                x: Vec::new(),
                wrench: Vec::new(),
                sd: Vec::new(),
            };
            for k in 0..300 {
                let time = 0.02 * f64::from(k) + 1.7 * trial as f64;
                let speed = (1.3 * time).sin() + 0.4 * (3.1 * time + trial as f64).cos();
                let mut x = vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                x.extend([speed, 0.0, 0.0, 1000.0]);
                of.x.extend(x.iter().map(|value| *value as f32));
                let chance = (f64::from(k / 10) * 12.9898 + trial as f64 * 78.233).sin() * 43758.5;
                of.wrench
                    .push([wrench(speed, chance.fract()), 0.0, 0.0, 0.0, 0.0, 0.0]);
                of.sd.push([0.3; 6]);
            }
            of
        });
        Lesson {
            recorded: recorded.collect(),
            feature_units: units.collect(),
            features,
            sample_period: 0.02,
            seed: 0,
            command: "a test".to_owned(),
        }
    }

    fn learn(lesson: &Lesson) -> Learned {
        learn_residual(lesson, &AtomicBool::new(false), &|_, _| {}).unwrap()
    }

    #[test]
    fn a_wrench_of_the_motion_is_learned_on_its_own_axis_alone() {
        let learned = learn(&lesson(4, &|speed, _| -8.0 * speed * speed.abs()));
        let Learned::Model { checkpoint, skill } = learned else {
            panic!("{learned:?}");
        };
        assert!(skill > 0.9, "{skill}");
        assert_eq!(checkpoint.card.outputs, ["force.x"]);
        assert!(checkpoint.card.residual);
        let folder = tempfile::tempdir().unwrap();
        checkpoint.save(&folder.path().join("residual")).unwrap();
        let read = Checkpoint::load(&folder.path().join("residual")).unwrap();
        assert!(read.card.residual && read.digest() == checkpoint.digest());
    }

    #[test]
    fn what_is_chance_or_within_its_error_is_not_offered() {
        for (wrench, words) in [
            (
                &(|_, chance| 5.0 * chance) as &dyn Fn(f64, f64) -> f64,
                "hardly better",
            ),
            (&|speed, _| 0.2 * speed, "does not stand out"),
        ] {
            let learned = learn(&lesson(3, wrench));
            let Learned::Nothing(why) = learned else {
                panic!("{learned:?}");
            };
            assert!(why.contains(words) && why.contains("offered"), "{why}");
        }
        let stopped = learn_residual(
            &lesson(3, &|speed, _| speed),
            &AtomicBool::new(true),
            &|_, _| {},
        );
        assert!(matches!(stopped.unwrap(), Learned::Cancelled));
    }
}
