//! Data and rollouts of the water that remembers, and torques of joints, through the real binary.
#![cfg(all(mujoco_plugins, feature = "cli"))]

use std::{
    fs,
    path::{Path, PathBuf},
};

use hydro_model::{checkpoint::Checkpoint, features::FeatureLayout};
use hydro_training::rollouts::Rollouts;
use safetensors::{Dtype, tensor::TensorView};
use serde_json::{Value, json};

use crate::{
    common::{
        Recipe, WRENCH, attention, lively,
        tiny::{bytes, sha256},
    },
    run::{hydro, message, refused},
};

const ROLLOUTS: &str = "tests/data/rollouts-strip";

fn succeeded(arguments: &[&str]) -> (Value, String) {
    let output = hydro(arguments);
    let told = message(&output);
    assert!(output.status.success(), "{told}");
    (serde_json::from_slice(&output.stdout).unwrap(), told)
}

fn refusal(arguments: &[&str]) -> String {
    refused(&hydro(arguments))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Samples of a trajectory, trajectories of a split, features.
const SIZE: (usize, usize, usize) = (30, 4, 13);

fn features() -> FeatureLayout {
    FeatureLayout::floating_base(&["fin".to_owned()]).unwrap()
}

fn strip() -> Value {
    json!({"name": "strip", "wake_share": 0.35, "added_mass": "inertia"})
}

fn heave(body: &str) -> Value {
    let mut matrix = vec![0.0; 36];
    matrix[14] = 0.01;
    json!({"body": body, "matrix": matrix})
}

/// A data set of strip water: a base with a fin, and torques on the fin.
fn dataset(folder: &Path, generalised: bool) -> PathBuf {
    let (t, m, n) = SIZE;
    assert_eq!(features().len(), n);
    let folder = folder.join(if generalised { "data" } else { "base-alone" });
    fs::create_dir_all(&folder).unwrap();
    let mut splits = serde_json::Map::new();
    for (salt, split) in ["train", "val", "test"].into_iter().enumerate() {
        let (mut x, mut wrench, mut forces) = (Vec::new(), Vec::new(), Vec::new());
        for sample in 0..m * t {
            let wave = (0.2 * sample as f32 + salt as f32).sin();
            let row = [0.3 * wave, wave, 1.0, 0.0, 0.0, 0.0];
            x.extend(row);
            x.extend([0.1 * wave, 0.0, 0.2 * wave, 0.5 * wave, 0.0, 0.1 * wave]);
            x.push(1000.0 + wave);
            let base = [-8.0 * wave, 0.1 * wave, wave, 0.2 * wave, 0.3 * wave, -wave];
            wrench.extend(base);
            forces.extend(base);
            forces.push(-3.0 * wave);
        }
        let time: Vec<f32> = (0..t).map(|k| 0.01 * k as f32).collect();
        let condition = vec![0_u8; 4 * m * t];
        let [x, wrench, forces, time] = [x, wrench, forces, time].map(|values| bytes(&values));
        let mut tensors = vec![
            ("x", Dtype::F32, vec![m, t, n], &x),
            ("wrench", Dtype::F32, vec![m, t, 6], &wrench),
            ("wrench_clean", Dtype::F32, vec![m, t, 6], &wrench),
            ("time", Dtype::F32, vec![t], &time),
            ("condition", Dtype::I32, vec![m, t], &condition),
        ];
        if generalised {
            tensors.push(("generalised", Dtype::F32, vec![m, t, 7], &forces));
        }
        let views = tensors
            .into_iter()
            .map(|(name, kind, shape, data)| (name, TensorView::new(kind, shape, data).unwrap()));
        let shard = safetensors::serialize(views.collect::<Vec<_>>(), None).unwrap();
        let file = format!("{split}-00000-of-00001.safetensors");
        fs::write(folder.join(&file), &shard).unwrap();
        let entry = json!({"file": file, "trajectories": m, "sha256": sha256(&shard)});
        splits.insert(
            split.to_owned(),
            json!({"trajectories": m, "shards": [entry]}),
        );
    }
    let layout = features();
    let units: Vec<&str> = layout.features().iter().map(|it| it.unit()).collect();
    let mut manifest = json!({
        "schema": "hydro-dataset/1", "name": "strips", "features": layout, "feature_units": units,
        "outputs": WRENCH, "output_units": ["N", "N", "N", "N m", "N m", "N m"], "frames": {"wrench": "base"},
        "sample_period": 0.01, "samples": t, "splits": splits, "water": strip(), "added_mass": [heave("hull")],
    });
    if generalised {
        manifest["generalised"] = json!([&WRENCH[..], &["fin"]].concat());
    }
    fs::write(folder.join("manifest.json"), manifest.to_string()).unwrap();
    folder
}

fn train<'a>(data: &'a Path, out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let places = ["train", "--data", text(data), "--out", text(out), "--json"];
    let sizes = [
        "--model", "mlp", "--hidden", "8", "--epochs", "1", "--batch", "4",
    ];
    [&places[..], &sizes[..], more].concat()
}

#[test]
fn torques_of_joints_are_trained_and_evaluated() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let out = folder.path().join("model");
    let (trained, _) = succeeded(&train(&data, &out, &["--outputs", "generalised"]));
    assert_eq!(trained["test"]["nrmse"].as_array().unwrap().len(), 7);
    let card = Checkpoint::load(&out).unwrap().card;
    assert_eq!(card.outputs[6], "joint_torque.fin");
    assert_eq!(card.water, Some(strip()));
    assert_eq!(card.added_mass[0].body, "hull");

    let evaluate = ["evaluate", "--checkpoint", text(&out), "--json", "--data"];
    let (found, told) = succeeded(&[&evaluate[..], &[text(&data)]].concat());
    assert_eq!(found["outputs"].as_array().unwrap().len(), 7);
    assert_eq!(found["other_water"], Value::Null, "{told}");
    assert!(!told.contains("WARNING"), "{told}");

    let base = dataset(folder.path(), false);
    let message = refusal(&[&evaluate[..], &[text(&base)]].concat());
    assert!(message.contains("no `generalised`"), "{message}");
    // A checkpoint of the wrench is not gone on with as one of the joints.
    let message = refusal(&train(&data, &out, &["--outputs", "wrench", "--resume"]));
    assert!(
        message.contains("kind of outputs") && message.contains("generalised"),
        "{message}"
    );
    let out = folder.path().join("other");
    let message = refusal(&train(&base, &out, &["--outputs", "generalised"]));
    assert!(
        message.contains("no `generalised`") && message.contains("--water strip"),
        "{message}"
    );
    let message = refusal(&train(&base, &out, &["--outputs", "joints"]));
    assert!(
        message.contains("expected wrench or generalised"),
        "{message}"
    );
    assert!(!out.exists());
}

#[test]
fn another_water_is_said_loudly() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    // Of MuJoCo's own water, or of a recorded model's.
    let checkpoint = lively(&["fin"]).save(folder.path(), "model");
    let arguments = [
        "evaluate",
        "--checkpoint",
        text(&checkpoint),
        "--data",
        text(&data),
    ];
    let (found, told) = succeeded(&[&arguments[..], &["--json"]].concat());
    let warning = found["other_water"].as_str().unwrap();
    for part in [
        "ANOTHER WATER",
        "no `water` is named",
        "strip (added_mass inertia, wake_share 0.35)",
    ] {
        assert!(warning.contains(part), "{warning}");
    }
    assert_eq!(warning.lines().count(), 3);
    assert!(told.contains(warning), "{told}");
    // Said without --json too.
    assert!(message(&hydro(&arguments)).contains("ANOTHER WATER"));
}

/// A checkpoint for the recorded robot; with `joints` its outputs are those of all joints.
fn swimmer(folder: &Path, joints: bool) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let names = Rollouts::load(&root.join(ROLLOUTS)).unwrap().index.joints;
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut recipe: Recipe = lively(&names);
    recipe.model = attention();
    if joints {
        for name in &names {
            recipe.outputs.push(format!("joint_torque.{name}").leak());
            recipe.mean.push(0.1);
            recipe.deviation.push(0.2);
        }
    }
    recipe.save(folder, if joints { "joints" } else { "base" })
}

fn simulate<'a>(checkpoint: &'a Path, rollouts: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let places = [
        "simulate",
        "--checkpoint",
        text(checkpoint),
        "--rollouts",
        rollouts,
    ];
    [&places[..], more].concat()
}

#[test]
fn the_oracle_of_all_joints_is_the_truth_and_that_of_the_base_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = swimmer(folder.path(), true);
    let (summary, told) = succeeded(&simulate(
        &checkpoint,
        ROLLOUTS,
        &["--json", "--long", ROLLOUTS],
    ));
    assert!(told.contains("ANOTHER WATER"), "{told}");
    let closed = &summary["closed_loop"];
    let rows = closed["rows"].as_array().unwrap();
    let names: Vec<&str> = rows
        .iter()
        .map(|row| row["name"].as_str().unwrap())
        .collect();
    let expected = [
        "attention-ode",
        "box fluid",
        "oracle of the base, every step replayed",
        "oracle of all joints, every step replayed",
    ];
    assert_eq!(names, expected);
    let path =
        |points: &Value| -> Vec<[f64; 3]> { serde_json::from_value(points.clone()).unwrap() };
    let truth = path(&closed["truth_path"]);
    let distance = |row: &Value| {
        let path = path(&row["path"]);
        assert_eq!(path.len(), truth.len());
        let pairs = path.iter().zip(&truth);
        let apart = pairs.map(|(a, b)| {
            a.iter()
                .zip(b)
                .map(|(a, b)| (a - b).powi(2))
                .sum::<f64>()
                .sqrt()
        });
        apart.fold(0.0, f64::max)
    };
    let [base, all] = [&rows[2], &rows[3]].map(distance);
    assert!(all < 1e-5, "{all} m");
    assert!(base > 10.0 * all && base > 1e-3, "{base} m");
    // Nothing but the recording tells the truth of this water.
    assert_eq!(summary["long"]["oracle"], Value::Null);
    assert!(
        summary["long"]["subject"]["speed"]["truth"]
            .as_f64()
            .unwrap()
            > 0.0
    );
}

#[test]
fn joints_are_not_asked_of_a_checkpoint_of_the_base() {
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = swimmer(folder.path(), false);
    let message = refusal(&simulate(
        &checkpoint,
        ROLLOUTS,
        &["--outputs", "generalised"],
    ));
    assert!(
        message.contains("--outputs generalised") && message.contains("on the base alone (force.x"),
        "{message}"
    );
    let joints = swimmer(folder.path(), true);
    let message = refusal(&simulate(&joints, ROLLOUTS, &["--mlp", text(&checkpoint)]));
    assert!(
        message.contains("output 6 (from 0) is missing, expected `joint_torque."),
        "{message}"
    );
}

#[test]
fn rollouts_of_another_water_without_its_steps_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = swimmer(folder.path(), false);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/rollouts");
    let copy = folder.path().join("rollouts");
    fs::create_dir(&copy).unwrap();
    for entry in fs::read_dir(&root).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), copy.join(entry.file_name())).unwrap();
    }
    let file = copy.join("rollouts.json");
    let mut index: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    index["water"] = json!({"name": "strip"});
    fs::write(&file, index.to_string()).unwrap();
    let message = refusal(&simulate(&checkpoint, text(&copy), &[]));
    assert!(
        message.contains("strip") && message.contains("no `step_force`"),
        "{message}"
    );
    // With the added mass in the inertia its gyroscopic part is needed too.
    index["added_mass"] = json!([heave("trunk")]);
    fs::write(&file, index.to_string()).unwrap();
    let message = refusal(&simulate(&checkpoint, text(&copy), &[]));
    assert!(message.contains("no array `gyroscopic`"), "{message}");
}
