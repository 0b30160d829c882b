//! Weights and ablations against attention that is known by hand.

use hydro_model::{MlpConfig, Tokens};

use super::*;
use crate::{
    TrainConfig, Trainer,
    dataset::{Dataset, Manifest, SCHEMA, Trajectory, write},
};

const WINDOW: usize = 3;

fn data(folder: &std::path::Path) -> Dataset {
    let manifest: Manifest = serde_json::from_value(serde_json::json!({
        "schema": SCHEMA, "name": "small", "features": ["linear_velocity.x", "density"], "feature_units": ["m/s", "kg/m^3"],
        "outputs": ["force.x"], "output_units": ["N"], "frames": {"wrench": "base"},
        "sample_period": 0.01, "samples": 12, "splits": {},
    }))
    .expect("a manifest");
    let trajectory = |phase: f32| {
        let speeds = (0..12).map(|k| (0.7 * k as f32 + phase).sin());
        Trajectory {
            x: speeds.clone().flat_map(|v| [v, 1000.0 + v * v]).collect(),
            wrench: speeds.map(|v| -3.0 * v).collect(),
        }
    };
    let train = vec![trajectory(0.0), trajectory(1.0)];
    let parts = [("train", train), ("val", vec![trajectory(2.0)])];
    write(folder, &manifest, &parts).expect("a data set")
}

/// A checkpoint after one pass, and the split on which it is looked at.
fn trained(model: ModelConfig) -> (Checkpoint, Split) {
    let folder = tempfile::tempdir().expect("a folder");
    let data = data(&folder.path().join("data"));
    let settings = TrainConfig {
        model,
        epochs: 1,
        horizon: 12,
        ..TrainConfig::default()
    };
    let mut trainer = Trainer::new(settings, &data).expect("a trainer");
    let never = std::sync::atomic::AtomicBool::new(false);
    trainer
        .run(&folder.path().join("run"), &never, &mut ())
        .expect("trained");
    let checkpoint = trainer.checkpoint("small", "a test").expect("a checkpoint");
    (checkpoint, data.split("val", None).expect("its split"))
}

fn attention(tokens: Tokens) -> AttentionOdeConfig {
    AttentionOdeConfig {
        window: WINDOW,
        heads: 2,
        embedding: 8,
        latent: 4,
        hidden: vec![8],
        tokens,
        ..AttentionOdeConfig::default()
    }
}

/// The checkpoint with these scores, looked at.
fn seen(
    checkpoint: &Checkpoint,
    split: &Split,
    config: &AttentionOdeConfig,
    scores: [[f64; WINDOW]; 2],
) -> AttentionUse {
    let scores = scores.map(|head| head.to_vec());
    let changed = with_scores(checkpoint, config, &scores).expect("changed");
    attention_use(&changed, split)
        .expect("looked at")
        .expect("attention")
}

fn close(found: f64, wanted: f64) {
    assert!((found - wanted).abs() < 1e-6, "{found}, expected {wanted}");
}

#[test]
fn known_weights_have_the_total_variations_found_by_hand() {
    let config = attention(Tokens::Samples);
    let (checkpoint, split) = trained(ModelConfig::AttentionOde(config.clone()));
    // 1/2, 1/4, 1/4 in one head: (1/6 + 1/12 + 1/12) / 2 from uniform. The other is uniform.
    let found = seen(
        &checkpoint,
        &split,
        &config,
        [[2f64.ln(), 0.0, 0.0], [0.0; 3]],
    );
    close(found.from_uniform[0], 1.0 / 6.0);
    close(found.from_uniform[1], 0.0);
    for head in 0..2 {
        close(found.from_mean[head], 0.0);
    }
    for (weight, wanted) in found.mean[0].iter().zip([0.5, 0.25, 0.25]) {
        close(*weight, wanted);
    }
    // Slopes 4 and 1: exp(-4 l) and exp(-l), l = 0, 1, 2.
    let slopes = [[0.0, -4.0, -8.0], [0.0, -1.0, -2.0]];
    let found = seen(&checkpoint, &split, &config, slopes);
    let [first, second] = found.from_slopes.as_deref().expect("slopes") else {
        panic!("two heads");
    };
    close(*first, 0.0);
    close(*second, 0.0);
    let newest = 1.0 / (1.0 + (-1f64).exp() + (-2f64).exp());
    close(found.mean[1][0], newest);
    close(found.from_uniform[1], newest - 1.0 / 3.0);
}

#[test]
fn an_ablation_of_weights_that_are_so_already_changes_nothing_and_another_does() {
    let config = attention(Tokens::Samples);
    let (checkpoint, split) = trained(ModelConfig::AttentionOde(config.clone()));
    let found = seen(&checkpoint, &split, &config, [[0.0; 3]; 2]);
    let error = |weights| {
        let mut rows = found.ablations.iter();
        rows.find(|row| row.weights == weights)
            .expect("a row")
            .nrmse
    };
    let names: Vec<_> = found.ablations.iter().map(|row| row.weights).collect();
    assert_eq!(names, ["learned", "mean", "slopes", "uniform", "newest"]);
    close(error("uniform"), error("learned"));
    close(error("mean"), error("learned"));
    assert!((error("newest") - error("learned")).abs() > 1e-5);
    assert!((error("slopes") - error("newest")).abs() > 1e-6);
}

#[test]
fn over_features_weights_without_queries_are_uniform() {
    let config = attention(Tokens::Features);
    let (checkpoint, split) = trained(ModelConfig::AttentionOde(config.clone()));
    let whole = attention_use(&checkpoint, &split)
        .expect("looked at")
        .expect("attention");
    assert_eq!(whole.from_slopes, None);
    assert!(whole.from_uniform.iter().all(|apart| *apart > 1e-3));
    let names: Vec<_> = whole.ablations.iter().map(|row| row.weights).collect();
    assert_eq!(names, ["learned", "uniform"]);
    let flat = seen(&checkpoint, &split, &config, [[0.0; 3]; 2]);
    assert!(flat.from_uniform.iter().all(|apart| *apart < 1e-6));
    close(flat.ablations[0].nrmse, whole.ablations[1].nrmse);
}

#[test]
fn a_model_without_attention_has_none() {
    let (checkpoint, split) = trained(ModelConfig::Mlp(MlpConfig {
        hidden: vec![4],
        ..MlpConfig::default()
    }));
    assert_eq!(attention_use(&checkpoint, &split).expect("looked at"), None);
    let model = checkpoint.model(None).expect("a model");
    assert_eq!(mean_attention(&model, &split).expect("looked at"), None);
}
