//! Training on a graphics card against training on the processor: the same gradients, the same run, a checkpoint like
//! any other. Without the feature `cuda`, or without a card, each test says so and passes, unless `HYDRO_REQUIRE_CUDA` is
//! set (`scripts/test_cuda.sh`).

use std::{
    collections::BTreeMap,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use candle_core::{Device, Tensor};
use hydro_model::{
    AttentionOdeConfig, MlpConfig, ModelConfig, Network, Parameters, RelaxationOdeConfig, Solver,
    checkpoint::Checkpoint,
    features::{Feature, FeatureLayout},
};
use hydro_training::{
    InitialForce, Observer, TrainConfig, TrainDevice, TrainOutcome, TrainProgress, Trainer,
    dataset::{self, Dataset, Manifest, Trajectory},
    evaluate,
};

/// The first card, if there is one.
fn card() -> Option<Device> {
    match Device::new_cuda(0) {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("HYDRO_REQUIRE_CUDA").is_some() => {
            panic!("no graphics card: {error}")
        }
        Err(error) => {
            let error = error.to_string();
            let words = error.lines().next().unwrap_or_default();
            eprintln!("skipped, no graphics card: {words}");
            None
        }
    }
}

/// Numbers in (-1, 1) without a generator.
fn ramp(shape: &[usize], step: f64) -> Tensor {
    let count: usize = shape.iter().product();
    let values = (0..count).map(|i| ((i + 1) as f64 * step).sin() as f32);
    Tensor::from_vec(values.collect(), shape, &Device::Cpu).unwrap()
}

/// Largest difference over the largest number of `theirs`.
fn difference(ours: &Tensor, theirs: &Tensor) -> f32 {
    let numbers = |tensor: &Tensor| -> Vec<f32> {
        let flat = tensor.to_device(&Device::Cpu).unwrap();
        flat.flatten_all().unwrap().to_vec1().unwrap()
    };
    let (ours, theirs) = (numbers(ours), numbers(theirs));
    assert_eq!(ours.len(), theirs.len());
    let error = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs());
    let scale = theirs.iter().map(|b| b.abs()).fold(0.0, f32::max);
    error.fold(0.0, f32::max) / scale.max(f32::MIN_POSITIVE)
}

fn models() -> Vec<ModelConfig> {
    let ode = AttentionOdeConfig {
        hidden: vec![64, 48],
        embedding: 16,
        latent: 12,
        ..AttentionOdeConfig::default()
    };
    let sum = AttentionOdeConfig {
        field_sees_force: false,
        ..ode.clone()
    };
    let plain = AttentionOdeConfig {
        skip: false,
        latent: 6,
        ..ode.clone()
    };
    vec![
        ModelConfig::AttentionOde(ode),
        ModelConfig::AttentionOde(sum),
        ModelConfig::AttentionOde(plain),
        relaxation_ode(1),
        relaxation_ode(3),
        ModelConfig::Mlp(MlpConfig {
            hidden: vec![64, 48],
            ..MlpConfig::default()
        }),
    ]
}

fn relaxation_ode(modes: usize) -> ModelConfig {
    ModelConfig::RelaxationOde(RelaxationOdeConfig {
        hidden: vec![64, 48],
        modes,
        ..RelaxationOdeConfig::default()
    })
}

#[test]
fn forces_and_gradients_are_those_of_the_processor() {
    let Some(card) = card() else { return };
    for model in models() {
        for solver in Solver::FIXED {
            let (inputs, outputs, batch, samples) = (10, 6, 18, 100);
            let z = ramp(&[batch, model.window() - 1 + samples, inputs], 0.53);
            let start = ramp(&[batch, outputs], 0.9);
            let run = |device: &Device| {
                let drawn =
                    Parameters::draw_on(device, 3, |vb| Network::new(&model, inputs, outputs, vb));
                let (network, parameters) = drawn.unwrap();
                let on = |tensor: &Tensor| tensor.to_device(device).unwrap();
                let forces = network.forward(&on(&z), &on(&start), solver).unwrap();
                let weights = on(&ramp(forces.dims(), 0.31));
                let loss = (forces.sqr().unwrap() * weights)
                    .unwrap()
                    .mean_all()
                    .unwrap();
                (forces, loss.backward().unwrap(), parameters)
            };
            let (theirs, their_gradients, their_weights) = run(&Device::Cpu);
            let (ours, our_gradients, our_weights) = run(&card);
            let error = difference(&ours, &theirs);
            assert!(error < 1e-5, "{model:?} {solver}: forces {error}");
            for ((name, ours), (_, theirs)) in our_weights.iter().zip(their_weights.iter()) {
                assert_eq!(difference(ours, theirs), 0.0, "{name} was drawn otherwise");
                let error = difference(
                    our_gradients.get(ours).unwrap(),
                    their_gradients.get(theirs).unwrap(),
                );
                assert!(error < 1e-4, "{model:?} {solver} {name}: {error}");
            }
        }
    }
}

/// F_{k+1} = F_k + (G x_k - F_k) / 2 with smooth x [v, density].
fn relaxation(folder: &Path) -> Dataset {
    let features = vec![Feature::LinearVelocity(0), Feature::Density];
    let about = Manifest {
        schema: dataset::SCHEMA.to_owned(),
        name: "relaxation".to_owned(),
        features: FeatureLayout::new(features).unwrap(),
        feature_units: vec!["m/s".to_owned(), "kg/m^3".to_owned()],
        outputs: vec!["force.x".to_owned(), "force.y".to_owned()],
        output_units: vec!["N".to_owned(); 2],
        frames: BTreeMap::new(),
        sample_period: 0.01,
        samples: 80,
        kinematics: None,
        generalised: None,
        water: None,
        added_mass: Vec::new(),
        splits: BTreeMap::new(),
        provenance: BTreeMap::new(),
    };
    let trajectory = |index: usize| {
        let phase = index as f32;
        let mut force = [phase.sin(), phase.cos()];
        let (mut x, mut wrench) = (Vec::new(), Vec::new());
        for k in 0..about.samples {
            let time = 0.05 * k as f32;
            let v = (1.7 * time + phase).sin();
            let density = 1000.0 + 10.0 * (time + 2.0 * phase).cos();
            x.extend([v, density]);
            wrench.extend(force);
            let drive = [3.0 * v * v.abs(), v - (density - 1000.0) / 5.0];
            for (force, drive) in force.iter_mut().zip(drive) {
                *force += 0.5 * (drive - *force);
            }
        }
        Trajectory { x, wrench }
    };
    let splits = [
        ("train", (0..16).map(trajectory).collect()),
        ("val", (16..20).map(trajectory).collect()),
    ];
    dataset::write(folder, &about, &splits).unwrap()
}

fn config() -> TrainConfig {
    TrainConfig {
        model: ModelConfig::AttentionOde(AttentionOdeConfig {
            hidden: vec![32, 32],
            embedding: 16,
            latent: 8,
            ..AttentionOdeConfig::default()
        }),
        epochs: 10,
        batch: 8,
        horizon: 80,
        ..TrainConfig::default()
    }
}

/// Mean losses of the epoch so far, step by step; stops after `last` steps.
struct Losses<'a> {
    seen: Vec<f64>,
    last: usize,
    cancel: &'a AtomicBool,
}

impl Observer for Losses<'_> {
    fn step(&mut self, progress: &TrainProgress) {
        self.seen.push(progress.loss);
        self.cancel
            .store(progress.step == self.last, Ordering::Relaxed);
    }
}

/// Goes on for at most `last` steps in all.
fn go_on(trainer: &mut Trainer, run: &Path, last: usize) -> (TrainOutcome, Vec<f64>) {
    let cancel = AtomicBool::new(false);
    let mut losses = Losses {
        seen: Vec::new(),
        last,
        cancel: &cancel,
    };
    let outcome = trainer.run(run, &cancel, &mut losses).unwrap();
    (outcome, losses.seen)
}

fn close(ours: &[f64], theirs: &[f64]) {
    assert_eq!(ours.len(), theirs.len());
    for (step, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        let error = (ours - theirs).abs() / theirs;
        assert!(
            error < 1e-3,
            "step {step}: loss {ours}, on the processor {theirs}"
        );
    }
}

#[test]
fn a_run_has_the_losses_of_the_processor_and_can_change_sides() {
    if card().is_none() {
        return;
    }
    let root = tempfile::tempdir().unwrap();
    let dataset = relaxation(&root.path().join("data"));
    let on = |device| Trainer::on(device, config(), &dataset).unwrap();
    let cuda = TrainDevice::Cuda(0);

    let mut there = on(TrainDevice::Cpu);
    assert_eq!(there.steps(), 20);
    let (outcome, theirs) = go_on(&mut there, &root.path().join("cpu"), usize::MAX);
    assert_eq!(outcome, TrainOutcome::Finished);
    assert!(
        theirs[18] < 0.7 * theirs[0],
        "nothing was learned: {theirs:?}"
    );
    let mut here = on(cuda);
    let (_, ours) = go_on(&mut here, &root.path().join("cuda"), usize::MAX);
    close(&ours, &theirs);
    let validation = |trainer: &Trainer| -> Vec<f64> {
        trainer
            .log()
            .iter()
            .map(|epoch| epoch.validation.unwrap())
            .collect()
    };
    close(&validation(&here), &validation(&there));

    // Its checkpoint is an ordinary one, and does on the processor what it did on the card.
    let folder = root.path().join("model");
    let checkpoint = here.checkpoint("relaxation", "test").unwrap();
    checkpoint.save(&folder).unwrap();
    let val = dataset.split("val", None).unwrap();
    let read = Checkpoint::load(&folder).unwrap();
    let found = evaluate(&read, &val, InitialForce::Recorded).unwrap();
    let best = here.log().last().unwrap().best.unwrap();
    close(&[found.errors.pooled], &[best]);

    // Begun on either, gone on with on the other, in the middle of an epoch.
    for (first, second) in [(cuda, TrainDevice::Cpu), (TrainDevice::Cpu, cuda)] {
        let run = root
            .path()
            .join(format!("{first}-{second}").replace(':', ""));
        let (outcome, mut losses) = go_on(&mut on(first), &run, 9);
        assert_eq!((outcome, losses.len()), (TrainOutcome::Cancelled, 9));
        let mut trainer = on(second);
        assert!(trainer.resume(&run).unwrap());
        assert_eq!(trainer.resumed_from(), Some(first));
        losses.extend(go_on(&mut trainer, &run, usize::MAX).1);
        close(&losses, &theirs);
    }
}

#[test]
fn a_card_that_is_not_there_is_named() {
    if card().is_none() {
        return;
    }
    let root = tempfile::tempdir().unwrap();
    let dataset = relaxation(&root.path().join("data"));
    let error = Trainer::on(TrainDevice::Cuda(999), config(), &dataset).unwrap_err();
    let message = error.to_string();
    assert!(
        message.starts_with("cuda:999 cannot be used: "),
        "{message}"
    );
}
