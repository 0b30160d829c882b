//! Training on a synthetic system in folders of their own.

use std::path::PathBuf;

use hydro_model::{
    AttentionOdeConfig, CnodeConfig, Control, EngineKind, LstmConfig, MlpConfig, MlpOdeConfig,
    ModelConfig, RelaxationOdeConfig, Scratch, Solver, document::hexadecimal,
};
use safetensors::{Dtype, tensor::TensorView};
use serde_json::json;
use sha2::{Digest as _, Sha256};

use super::*;

/// Trajectories and samples of a split.
const SIZE: (usize, usize) = (12, 40);

/// F_{k+1} = F_k + (G x_k - F_k) / 2 with smooth x [v, density] and G of full rank: linear, so a model with a linear
/// part can be exact.
fn write_dataset(root: &Path) -> Dataset {
    let (m, t) = SIZE;
    let mut splits = serde_json::Map::new();
    for (index, name) in ["train", "val"].into_iter().enumerate() {
        let (mut x, mut wrench) = (Vec::new(), Vec::new());
        for trajectory in 0..m {
            let phase = (index * m + trajectory) as f32;
            let mut force = [phase.sin(), phase.cos()];
            for k in 0..t {
                let time = 0.05 * k as f32;
                let (v, density) = (
                    (1.7 * time + phase).sin(),
                    1000.0 + 10.0 * (time + 2.0 * phase).cos(),
                );
                x.extend([v, density]);
                wrench.extend(force);
                let drive = [
                    3.0 * v + (density - 1000.0) / 10.0,
                    v - (density - 1000.0) / 5.0,
                ];
                for (force, drive) in force.iter_mut().zip(drive) {
                    *force += 0.5 * (drive - *force);
                }
            }
        }
        let bytes =
            |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
        let time: Vec<f32> = (0..t).map(|k| 0.01 * k as f32).collect();
        let parts = [
            ("x", Dtype::F32, vec![m, t, 2], bytes(&x)),
            ("wrench", Dtype::F32, vec![m, t, 2], bytes(&wrench)),
            ("wrench_clean", Dtype::F32, vec![m, t, 2], bytes(&wrench)),
            ("time", Dtype::F32, vec![t], bytes(&time)),
            ("condition", Dtype::I32, vec![m, t], vec![0; 4 * m * t]),
        ];
        let views = parts.iter().map(|(name, dtype, shape, bytes)| {
            (
                *name,
                TensorView::new(*dtype, shape.clone(), bytes).expect("fits"),
            )
        });
        let shard = safetensors::serialize(views, None).expect("serialises");
        let file = format!("{name}-00000-of-00001.safetensors");
        fs::write(root.join(&file), &shard).expect("written");
        let sha256 = hexadecimal(&Sha256::digest(&shard));
        let entry = json!({"trajectories": m, "shards": [{"file": file, "trajectories": m, "sha256": sha256}]});
        splits.insert(name.to_owned(), entry);
    }
    let manifest = json!({
        "schema": "hydro-dataset/1", "name": "relaxation",
        "features": ["linear_velocity.x", "density"], "feature_units": ["m/s", "kg/m^3"],
        "outputs": ["force.x", "force.y"], "output_units": ["N", "N"], "frames": {},
        "sample_period": 0.01, "samples": t, "splits": splits,
    });
    fs::write(root.join("manifest.json"), manifest.to_string()).expect("written");
    Dataset::open(root).expect("valid")
}

fn config() -> TrainConfig {
    TrainConfig {
        model: ModelConfig::AttentionOde(AttentionOdeConfig {
            window: 3,
            heads: 2,
            embedding: 8,
            latent: 4,
            hidden: vec![16],
            ..AttentionOdeConfig::default()
        }),
        epochs: 4,
        batch: 8,
        horizon: 20,
        learning_rate: 1e-2,
        ..TrainConfig::default()
    }
}

/// A data set and a folder for runs.
fn fixture() -> (tempfile::TempDir, Dataset, PathBuf) {
    let root = tempfile::tempdir().expect("a folder");
    let dataset = write_dataset(root.path());
    let run = root.path().join("run");
    (root, dataset, run)
}

fn values(tensor: &Tensor) -> Vec<f32> {
    tensor
        .flatten_all()
        .and_then(|t| t.to_vec1())
        .expect("numbers")
}

fn weights(trainer: &Trainer) -> Vec<Vec<f32>> {
    trainer
        .parameters
        .iter()
        .map(|(_, var)| values(var))
        .chain(trainer.best.values().map(values))
        .collect()
}

fn trained(config: TrainConfig, dataset: &Dataset, run: &Path) -> Trainer {
    let mut trainer = Trainer::new(config, dataset).expect("a trainer");
    let outcome = trainer
        .run(run, &AtomicBool::new(false), &mut ())
        .expect("runs");
    assert_eq!(outcome, TrainOutcome::Finished);
    trainer
}

#[test]
fn a_linear_relaxation_is_learned_to_near_nothing() {
    let (_root, dataset, run) = fixture();
    for solver in Solver::ALL {
        let config = TrainConfig {
            epochs: 400,
            patience: 400,
            batch: 12,
            solver,
            weight_decay: 0.0,
            ..config()
        };
        let trainer = trained(config, &dataset, &run.join(solver.to_string()));
        let best = trainer.position.best.expect("validated");
        let loss = trainer.log().last().expect("epochs").loss;
        assert!(loss < 2e-3, "{solver}: training loss {loss}");
        assert!(best < 0.1, "{solver}: validation error {best}");
        // The checkpoint holds the best weights: the same error through its own door.
        let checkpoint = trainer.checkpoint("relaxation", "test").expect("valid");
        let evaluation = crate::evaluate(&checkpoint, &trainer.validation, InitialForce::Recorded);
        assert!((evaluation.expect("evaluated").errors.pooled - best).abs() < 1e-9);
    }
}

#[test]
fn the_card_says_in_what_range_it_was_trained() {
    let (_root, dataset, _) = fixture();
    let config = TrainConfig {
        trajectories: Some(2),
        ..config()
    };
    let trainer = Trainer::new(config, &dataset).expect("a trainer");
    let card = trainer.checkpoint("drawn", "test").expect("valid").card;
    let envelope = card.envelope.expect("measured");
    let column = |rows: &dyn Fn(usize) -> Vec<f32>, at: usize| -> Vec<f64> {
        let both = [rows(0), rows(1)].concat();
        both.chunks_exact(2).map(|row| f64::from(row[at])).collect()
    };
    let train = &trainer.train;
    let ranges = [
        (
            column(&|i| train.x(i).to_vec(), 0),
            envelope.least[0],
            envelope.most[0],
        ),
        (
            column(&|i| train.x(i).to_vec(), 1),
            envelope.least[1],
            envelope.most[1],
        ),
        (
            column(&|i| train.wrench(i).to_vec(), 0),
            envelope.least_force[0],
            envelope.most_force[0],
        ),
        (
            column(&|i| train.wrench(i).to_vec(), 1),
            envelope.least_force[1],
            envelope.most_force[1],
        ),
    ];
    for (values, least, most) in ranges {
        assert!(values.iter().all(|value| (least..=most).contains(value)));
        assert!(values.contains(&least) && values.contains(&most) && least < most);
    }
}

#[test]
fn the_continuous_adjoint_trains_too_and_says_how_far_its_gradient_is_off() {
    let (_root, dataset, run) = fixture();
    let errors = |solver: Solver, adjoint| {
        let config = TrainConfig {
            solver,
            adjoint,
            epochs: 30,
            patience: 30,
            ..config()
        };
        let trainer = trained(config, &dataset, &run.join(format!("{solver}-{adjoint}")));
        assert!(
            trainer.position.best.expect("validated") < 0.5,
            "{solver} {adjoint}"
        );
        let errors = trainer.log().iter().map(|record| record.adjoint_error);
        errors.collect::<Vec<Option<f64>>>()
    };
    for solver in Solver::FIXED {
        assert!(
            errors(solver, Adjoint::Discrete)
                .iter()
                .all(Option::is_none)
        );
        let found = errors(solver, Adjoint::Continuous);
        assert!(
            found
                .iter()
                .all(|error| error.is_some_and(|e| e > 1e-6 && e < 1.0)),
            "{solver}: {found:?}"
        );
    }
    let error = Trainer::on(
        TrainDevice::Cuda(0),
        TrainConfig {
            adjoint: Adjoint::Continuous,
            ..config()
        },
        &dataset,
    )
    .expect_err("for the processor alone");
    assert_eq!(
        error.to_string(),
        "adjoint is continuous, expected discrete on cuda:0; the other is for the processor alone"
    );
}

#[test]
fn adaptive_steps_are_taken_on_the_processor_alone() {
    let (_root, dataset, _) = fixture();
    let config = TrainConfig {
        solver: Solver::DormandPrince,
        ..config()
    };
    let error = Trainer::on(TrainDevice::Cuda(0), config, &dataset).expect_err("no kernels there");
    assert_eq!(
        error.to_string(),
        "solver is dopri5, expected euler or rk4 on cuda:0; it is for the processor alone"
    );
}

/// Every model that has a memory comes well below what a memoryless one of the same training is left with.
#[test]
fn every_kind_of_model_learns_the_lag() {
    let (_root, dataset, run) = fixture();
    let best = |model: ModelConfig, solver| {
        let name = model.kind();
        let config = TrainConfig {
            model,
            solver,
            epochs: 200,
            patience: 200,
            batch: 12,
            weight_decay: 0.0,
            ..config()
        };
        let trainer = trained(config, &dataset, &run.join(name));
        let best = trainer.position.best.expect("validated");
        // The checkpoint holds the best weights: the same error through its own door.
        let checkpoint = trainer.checkpoint(name, "test").expect("valid");
        let evaluation = crate::evaluate(&checkpoint, &trainer.validation, InitialForce::Recorded);
        assert!((evaluation.expect("evaluated").errors.pooled - best).abs() < 1e-9);
        best
    };
    let memoryless = best(
        ModelConfig::Mlp(MlpConfig {
            hidden: vec![16],
            ..MlpConfig::default()
        }),
        Solver::Euler,
    );
    let kinds = [
        ModelConfig::MlpOde(MlpOdeConfig {
            latent_hidden: vec![8],
            latent: 4,
            hidden: vec![16],
            ..MlpOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: vec![16],
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: vec![16],
            memory: 8,
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::Lstm(LstmConfig {
            hidden: vec![12, 12],
            skip: false,
            ..LstmConfig::default()
        }),
    ];
    for model in kinds {
        // An LSTM is not given the force at the start, and has to wait until its past tells.
        let share = if matches!(model, ModelConfig::Lstm(_)) {
            1.0
        } else {
            0.7
        };
        let name = model.kind();
        let left = best(model, Solver::Euler);
        assert!(
            left < share * memoryless,
            "{name}: validation error {left}, memoryless {memoryless}"
        );
    }
}

/// A CNODE has no linear part that could be exact, and is slow to learn; that it learns at all is held.
#[test]
fn a_controlled_equation_learns_too() {
    let (_root, dataset, run) = fixture();
    for control in Control::ALL {
        let config = TrainConfig {
            model: ModelConfig::Cnode(CnodeConfig {
                hidden_state: 4,
                hidden: vec![16, 16],
                control,
                ..CnodeConfig::default()
            }),
            solver: Solver::Rk4,
            epochs: 100,
            patience: 100,
            batch: 12,
            weight_decay: 0.0,
            ..config()
        };
        let trainer = trained(config, &dataset, &run.join(control.to_string()));
        let (first, best) = (
            trainer.log()[0].validation.expect("validated"),
            trainer.position.best.expect("validated"),
        );
        assert!(
            best < 0.8 * first,
            "{control}: {first} at first, {best} at best"
        );
        // It has learned to guess a force from the sample alone, as well as that can be done: the force lags.
        let checkpoint = trainer.checkpoint("cnode", "").expect("built");
        let engine = checkpoint
            .engine(EngineKind::Fused, None)
            .expect("an engine");
        let split = &trainer.validation;
        let (mut guess, mut errors, mut spread) = ([0.0; 2], 0.0, 0.0);
        for index in 0..split.len() {
            let x: Vec<f64> = split.x(index)[20..22]
                .iter()
                .map(|v| f64::from(*v))
                .collect();
            engine.estimate(&x, &mut guess, &mut Scratch::default());
            for (axis, guess) in guess.iter().enumerate() {
                let truth = f64::from(split.wrench(index)[20 + axis]);
                errors += (guess - truth).powi(2);
                spread += truth.powi(2);
            }
        }
        assert!(errors < 0.3 * spread, "{control}: {errors} of {spread}");
    }
}

#[test]
fn models_whose_time_loop_is_for_the_processor_alone_are_refused_elsewhere() {
    let (_root, dataset, _) = fixture();
    let card = "cuda:0".parse().expect("a device");
    let config = TrainConfig {
        model: ModelConfig::Lstm(LstmConfig::default()),
        ..config()
    };
    let error = Trainer::on(card, config, &dataset).expect_err("no such operation");
    assert_eq!(
        error.to_string(),
        "device is cuda:0, expected cpu, the only one of the model lstm"
    );
}

#[test]
fn a_memoryless_model_trains_too_and_cannot_know_the_lag() {
    let (_root, dataset, run) = fixture();
    let model = ModelConfig::Mlp(MlpConfig {
        hidden: vec![16],
        ..MlpConfig::default()
    });
    let trainer = trained(
        TrainConfig {
            model,
            epochs: 40,
            ..config()
        },
        &dataset,
        &run,
    );
    let best = trainer.position.best.expect("validated");
    assert!((0.02..0.5).contains(&best), "validation error {best}");
}

#[test]
fn the_same_seed_gives_the_same_weights_and_another_does_not() {
    let (_root, dataset, run) = fixture();
    let one = trained(config(), &dataset, &run.join("one"));
    let two = trained(config(), &dataset, &run.join("two"));
    assert_eq!(weights(&one), weights(&two));
    let other = trained(
        TrainConfig {
            seed: 1,
            ..config()
        },
        &dataset,
        &run.join("other"),
    );
    assert_ne!(weights(&one), weights(&other));
}

/// Sets the flag after some steps.
struct StopAfter<'a>(usize, &'a AtomicBool);

impl Observer for StopAfter<'_> {
    fn step(&mut self, progress: &TrainProgress) {
        if progress.step == self.0 {
            self.1.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn a_run_that_was_stopped_anywhere_ends_as_one_that_was_not() {
    let (_root, dataset, run) = fixture();
    let whole = trained(config(), &dataset, &run.join("whole"));
    let per_epoch = steps_per_epoch(&whole.config, &whole.train);
    // In the middle of the first epoch, and at the border of the second and third.
    for stop in [per_epoch / 2, 2 * per_epoch] {
        let folder = run.join(stop.to_string());
        let cancel = AtomicBool::new(false);
        let mut first = Trainer::new(config(), &dataset).expect("a trainer");
        let outcome = first
            .run(&folder, &cancel, &mut StopAfter(stop, &cancel))
            .expect("runs");
        assert_eq!(
            (outcome, first.position.step),
            (TrainOutcome::Cancelled, stop)
        );
        let mut second = Trainer::new(config(), &dataset).expect("a trainer");
        assert!(second.resume(&folder).expect("resumes"));
        second
            .run(&folder, &AtomicBool::new(false), &mut ())
            .expect("runs");
        assert_eq!(weights(&whole), weights(&second), "stopped at {stop}");
        assert_eq!(whole.log(), second.log());
        for name in [LOG, STATE] {
            let read = |run: &Path| fs::read(run.join(name)).expect("a file");
            assert!(read(&run.join("whole")) == read(&folder), "{name}");
        }
    }
}

/// Each writer of a header shuffles its metadata anew.
#[test]
fn equal_states_have_equal_bytes() {
    let (_root, dataset, run) = fixture();
    let whole = trained(config(), &dataset, &run);
    let path = run.join(STATE);
    let first = fs::read(&path).expect("read");
    for _ in 0..8 {
        state::save(
            &path,
            (&whole.config, &whole.dataset_sha256),
            TrainDevice::Cpu,
            &whole.position,
            (&whole.parameters, &whole.best),
            &whole.optimiser,
        )
        .expect("written");
        assert!(fs::read(&path).expect("read") == first);
    }
}

#[test]
fn a_run_goes_on_upon_another_device_and_says_from_which() {
    let (_root, dataset, run) = fixture();
    let whole = trained(config(), &dataset, &run);
    let resumed = || {
        let mut trainer = Trainer::new(config(), &dataset).expect("a trainer");
        assert_eq!(trainer.resumed_from(), None);
        assert!(trainer.resume(&run).expect("resumes"));
        assert_eq!(weights(&trainer), weights(&whole));
        trainer.resumed_from()
    };
    assert_eq!(resumed(), Some(TrainDevice::Cpu));
    state::save(
        &run.join(STATE),
        (&whole.config, &whole.dataset_sha256),
        TrainDevice::Cuda(1),
        &whole.position,
        (&whole.parameters, &whole.best),
        &whole.optimiser,
    )
    .expect("written");
    assert_eq!(resumed(), Some(TrainDevice::Cuda(1)));

    // A state from before there were devices: blanks in the place of the field.
    let bytes = fs::read(run.join(STATE)).expect("read");
    let field = br#"\"device\":\"cuda:1\","#;
    let at = bytes.windows(field.len()).position(|part| part == field);
    let mut older = bytes.clone();
    older[at.expect("named")..][..field.len()].fill(b' ');
    fs::write(run.join(STATE), &older).expect("written");
    let mut trainer = Trainer::new(config(), &dataset).expect("a trainer");
    let message = trainer.resume(&run).expect_err("changed").to_string();
    assert!(
        message.contains("damaged: its content is not what was saved"),
        "{message}"
    );
    // Nor were there digests then.
    let field = br#""sha256":"#;
    let at = older.windows(field.len()).position(|part| part == field);
    older[at.expect("named") + 1] = b'S';
    fs::write(run.join(STATE), older).expect("written");
    assert_eq!(resumed(), Some(TrainDevice::Cpu));
}

#[test]
fn a_state_of_other_settings_or_of_nothing_is_refused() {
    let (_root, dataset, run) = fixture();
    trained(
        TrainConfig {
            epochs: 1,
            ..config()
        },
        &dataset,
        &run,
    );
    let mut other = Trainer::new(
        TrainConfig {
            epochs: 2,
            ..config()
        },
        &dataset,
    )
    .expect("a trainer");
    let message = other.resume(&run).expect_err("other settings").to_string();
    assert!(
        message.contains(
            "made with other settings: epochs is 1, expected 2; remove it or start in another folder"
        ),
        "{message}"
    );
    let mut elsewhere = Trainer::new(
        TrainConfig {
            epochs: 1,
            ..config()
        },
        &dataset,
    )
    .expect("a trainer");
    let made_of = elsewhere.dataset_sha256[..8].to_owned();
    elsewhere.dataset_sha256 = "0".repeat(64);
    let message = elsewhere.resume(&run).expect_err("other data").to_string();
    let digests = format!("has the sha256 {made_of}..., expected 00000000...; remove it");
    assert!(
        message.contains("another data set: its manifest.json") && message.contains(&digests),
        "{message}"
    );
    let bytes = fs::read(run.join(STATE)).expect("read");
    let mut flipped = bytes.clone();
    *flipped.last_mut().expect("not empty") ^= 1;
    fs::write(run.join(STATE), flipped).expect("written");
    let message = other.resume(&run).expect_err("flipped").to_string();
    assert!(
        message.contains("damaged: its content is not what was saved"),
        "{message}"
    );
    fs::write(run.join(STATE), &bytes[..bytes.len() / 2]).expect("written");
    assert!(
        other
            .resume(&run)
            .expect_err("cut")
            .to_string()
            .contains("not a training state")
    );
    assert!(!other.resume(&run.join("nowhere")).expect("none there"));
}

/// The data set of the fixture without the trajectories of a split.
fn without(dataset: &Dataset, split: &str) -> Dataset {
    let path = dataset.folder().join("manifest.json");
    let bytes = fs::read(&path).expect("read");
    let mut manifest: serde_json::Value = serde_json::from_slice(&bytes).expect("JSON");
    manifest["splits"][split] = serde_json::json!({"trajectories": 0, "shards": []});
    fs::write(&path, manifest.to_string()).expect("written");
    Dataset::open(dataset.folder()).expect("a data set")
}

#[test]
fn a_training_split_without_a_trajectory_is_refused_before_any_work() {
    let (root, dataset, _) = fixture();
    let error = Trainer::new(config(), &without(&dataset, "train")).expect_err("no trajectory");
    let text = error.to_string();
    let folder = root.path().display().to_string();
    assert!(
        text.contains(&format!("the train split of {folder}"))
            && text.contains("is empty: it needs a trajectory at least"),
        "{text}"
    );
}

#[test]
fn without_validation_every_epoch_is_trained_and_the_last_weights_are_kept() {
    let (_root, dataset, run) = fixture();
    let dataset = without(&dataset, "val");
    let config = TrainConfig {
        epochs: 3,
        patience: 1,
        ..config()
    };
    let mut trainer = Trainer::new(config.clone(), &dataset).expect("a trainer");
    assert!(!trainer.validates());
    let outcome = trainer
        .run(&run, &AtomicBool::new(false), &mut ())
        .expect("runs");
    assert_eq!((outcome, trainer.log().len()), (TrainOutcome::Finished, 3));
    let told = trainer.log().iter();
    let mut told = told.flat_map(|epoch| [epoch.validation, epoch.best]);
    assert!(told.all(|error| error.is_none()));
    let kept = trainer.checkpoint("last", "").expect("a checkpoint");
    let last = trainer.parameters.snapshot().expect("weights");
    for (name, weights) in kept.weights() {
        assert_eq!(values(weights), values(&last[name]), "{name}");
    }
    // The log of such a run is read again.
    let mut again = Trainer::new(config, &dataset).expect("a trainer");
    assert!(again.resume(&run).expect("resumes"));
    assert_eq!(again.log(), trainer.log());
}

#[test]
fn training_stops_when_the_validation_error_no_longer_falls() {
    let (_root, dataset, run) = fixture();
    // A vanishing rate leaves the weights, and so the error, as they are.
    let config = TrainConfig {
        learning_rate: 1e-30,
        epochs: 50,
        patience: 2,
        ..config()
    };
    let mut trainer = Trainer::new(config, &dataset).expect("a trainer");
    let outcome = trainer
        .run(&run, &AtomicBool::new(false), &mut ())
        .expect("runs");
    assert_eq!(
        (outcome, trainer.position.epoch),
        (TrainOutcome::StoppedEarly, 3)
    );
}

#[test]
fn a_loss_that_is_no_number_stops_with_advice() {
    let (_root, dataset, run) = fixture();
    let config = TrainConfig {
        learning_rate: 1.0,
        clip_norm: 1e30,
        epochs: 200,
        horizon: 40,
        ..config()
    };
    let mut trainer = Trainer::new(config, &dataset).expect("a trainer");
    for (_, var) in trainer.parameters.iter() {
        let huge = (var.as_tensor() * 1e12).expect("scaled");
        var.set(&huge).expect("set");
    }
    let error = trainer
        .run(&run, &AtomicBool::new(false), &mut ())
        .expect_err("diverges")
        .to_string();
    assert!(error.contains("lower the learning rate (now"), "{error}");
}

#[test]
fn a_run_in_an_impossible_place_says_where() {
    let (root, dataset, _) = fixture();
    let file = root.path().join("file");
    fs::write(&file, "in the way").expect("written");
    let mut trainer = Trainer::new(config(), &dataset).expect("a trainer");
    let error = trainer
        .run(&file.join("run"), &AtomicBool::new(false), &mut ())
        .expect_err("a file is in the way");
    assert!(error.to_string().contains("file"), "{error}");
}
