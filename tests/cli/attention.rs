//! `hydro evaluate --attention` through the real binary.
#![cfg(feature = "cli")]

use std::path::Path;

use serde_json::Value;

use crate::{
    common::tiny::dataset,
    run::{hydro, message, refused},
};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A checkpoint of a kind after one pass over the data.
fn train(data: &Path, out: &Path, model: &[&str]) {
    let places = ["train", "--data", text(data), "--out", text(out)];
    let length = ["--hidden", "8", "--epochs", "1", "--model"];
    let output = hydro(&[&places[..], &length, model].concat());
    assert!(output.status.success(), "{}", message(&output));
}

#[test]
fn attention_is_told_of_and_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let [data, model] = ["data", "model"].map(|name| folder.path().join(name));
    dataset(&data);
    train(&data, &model, &["attention-ode", "--latent", "4"]);
    let evaluate = ["evaluate", "--checkpoint", text(&model), "--data"];
    let evaluate = [&evaluate[..], &[text(&data), "--attention"]].concat();
    let told = hydro(&[&evaluate[..], &["--json"]].concat());
    let told: Value = serde_json::from_slice(&told.stdout).unwrap();
    let found = &told["attention"];
    let heads: Vec<Vec<f64>> = serde_json::from_value(found["mean"].clone()).unwrap();
    assert_eq!((heads.len(), heads[0].len()), (4, 8));
    for name in ["from_uniform", "from_slopes", "from_mean"] {
        let apart: Vec<f64> = serde_json::from_value(found[name].clone()).unwrap();
        assert_eq!(apart.len(), 4, "{name}");
        assert!(apart.iter().all(|apart| (0.0..1.0).contains(apart)));
    }
    // The first sample is given and counted by one of the two only.
    let learned = found["ablations"][0]["nrmse"].as_f64().unwrap();
    let error = told["errors"]["pooled"].as_f64().unwrap();
    assert!((learned - error).abs() < 0.05 * error, "{learned} {error}");

    let page = String::from_utf8(hydro(&evaluate).stdout).unwrap();
    for part in ["Total variation", "head", "uniform", "slopes", "newest"] {
        assert!(page.contains(part), "{part}: {page}");
    }
}

#[test]
fn a_model_without_attention_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [data, model] = ["data", "model"].map(|name| folder.path().join(name));
    dataset(&data);
    train(&data, &model, &["mlp"]);
    let places = [
        "evaluate",
        "--checkpoint",
        text(&model),
        "--data",
        text(&data),
    ];
    let said = refused(&hydro(&[&places[..], &["--attention"]].concat()));
    assert!(
        said.contains("--attention:")
            && said.contains("of the kind mlp")
            && said.contains("expected attention-ode"),
        "{said}"
    );
}
