//! `hydro simulate` as a user meets it, on the recorded rollouts and a model of drawn weights.
#![cfg(all(mujoco_plugins, feature = "cli"))]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use hydro_training::rollouts::Rollouts;
use serde_json::Value;

use crate::run::refused;

const ROLLOUTS: &str = "tests/data/rollouts";

/// A folder with a checkpoint for the recorded robot.
fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let joints = Rollouts::load(&root.join(ROLLOUTS)).unwrap().index.joints;
    let joints: Vec<&str> = joints.iter().map(String::as_str).collect();
    let checkpoint = crate::common::lively(&joints).save(folder.path(), "model");
    (folder, checkpoint)
}

fn simulate(checkpoint: &Path, rollouts: &str, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hydro"))
        .args(["simulate", "--checkpoint", text(checkpoint)])
        .args(["--rollouts", rollouts])
        .args(more)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap()
}

fn refusal(checkpoint: &Path, rollouts: &str, more: &[&str]) -> String {
    refused(&simulate(checkpoint, rollouts, more))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Base positions along the first run.
fn path(points: &Value) -> Vec<[f64; 3]> {
    serde_json::from_value(points.clone()).unwrap()
}

#[test]
fn the_comparison_is_json_and_a_page_of_its_own() {
    let (folder, checkpoint) = place();
    let report = folder.path().join("report/page.html");
    let output = simulate(
        &checkpoint,
        ROLLOUTS,
        &["--json", "--report", text(&report)],
    );
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");

    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(summary["open_loop"].is_null(), "no data set was given");
    let closed = &summary["closed_loop"];
    assert_eq!(closed["runs"], 3);
    let rows = closed["rows"].as_array().unwrap();
    let names: Vec<&str> = rows
        .iter()
        .map(|row| row["name"].as_str().unwrap())
        .collect();
    let expected = [
        "attention-ode",
        "box fluid",
        "oracle, at its own state",
        "oracle, replayed",
    ];
    assert_eq!(names, expected);
    // The recorded runs are shorter than the first horizon: the error is read at the end of the path.
    assert_eq!(closed["horizons"], Value::Array(Vec::new()));
    let truth = path(&closed["truth_path"]);
    let oracle = path(&rows[2]["path"]);
    assert_eq!(oracle.len(), truth.len());
    let (end, there) = (oracle.last().unwrap(), truth.last().unwrap());
    let squares = end.iter().zip(there).map(|(a, b)| (a - b).powi(2));
    let error = squares.sum::<f64>().sqrt();
    assert!(error.is_finite() && error < 0.1, "{error} m");
    assert_eq!(rows[2]["diverged"], 0);

    let page = fs::read_to_string(&report).unwrap();
    assert!(page.contains("<svg") && page.ends_with("</html>\n"));
    let namespaced = page.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http://", "https://"] {
        assert!(
            !namespaced.contains(outside),
            "the page refers to {outside}"
        );
    }
    assert_eq!(names_in(report.parent().unwrap()), ["page.html"]);
}

#[test]
fn runs_too_short_for_a_distance_give_no_verdict() {
    let (_folder, checkpoint) = place();
    let output = simulate(&checkpoint, ROLLOUTS, &[]);
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}");
    for part in ["No run lasts 1 s", "no baseline to compare with"] {
        assert!(told.contains(part), "{told}");
    }
    assert!(
        !told.contains("better than") && !told.contains("NaN"),
        "{told}"
    );
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let (folder, checkpoint) = place();
    let message = refusal(&checkpoint, "tests/data/no-rollouts", &[]);
    assert!(message.contains("tests/data/no-rollouts"), "{message}");

    let other = crate::common::lively(&["fin"]).save(folder.path(), "fish");
    let message = refusal(&other, ROLLOUTS, &[]);
    assert!(
        message.contains(ROLLOUTS)
            && message
                .contains("feature 0 (from 0) is `position.FR_hip_joint`, expected `position.fin`"),
        "{message}"
    );

    let data = folder.path().join("data");
    crate::common::tiny::dataset(&data);
    let message = refusal(&checkpoint, ROLLOUTS, &["--data", text(&data)]);
    assert!(
        message.contains(text(&data))
            && message.contains("is `position.thigh`, expected `position.FR_hip_joint` as in"),
        "{message}"
    );

    let (clip, report) = (
        folder.path().join("clip.gif"),
        folder.path().join("page.html"),
    );
    fs::write(&clip, "a film").unwrap();
    let flags = ["--video", text(&clip), "--report", text(&report)];
    let message = refusal(&checkpoint, ROLLOUTS, &flags);
    assert!(
        message.contains("clip.gif") && message.contains(".mp4 or .webm"),
        "{message}"
    );
    let message = refusal(&checkpoint, ROLLOUTS, &flags[..2]);
    assert!(message.contains("--report"), "{message}");
    assert_eq!(
        names_in(folder.path()),
        ["clip.gif", "data", "fish", "model"]
    );
}

/// The true wrench is only true in the scene that the rollouts were recorded in.
#[test]
fn a_truth_that_is_not_the_recorded_one_is_refused() {
    let (folder, checkpoint) = place();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(ROLLOUTS);
    let copy = folder.path().join("rollouts");
    fs::create_dir(&copy).unwrap();
    for name in names_in(&root) {
        fs::copy(root.join(&name), copy.join(&name)).unwrap();
    }
    let file = copy.join("rollouts.json");
    let index: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let recorded = index["model_sha256"].as_str().unwrap();
    let refused = |key: &str, value: &str| {
        let mut index = index.clone();
        index[key] = value.into();
        fs::write(&file, index.to_string()).unwrap();
        refusal(&checkpoint, text(&copy), &[])
    };
    let other = "0".repeat(64);
    let message = refused("model_sha256", &other);
    assert!(
        message.contains("b1_truth.xml") && message.contains(&other) && message.contains(recorded),
        "{message}"
    );
    let message = refused("model", "mjcf/no_such_scene.xml");
    assert!(
        message.contains("the rollouts' model") && message.contains("no_such_scene.xml"),
        "{message}"
    );
}

#[test]
fn a_report_that_cannot_be_written_leaves_nothing() {
    let (folder, checkpoint) = place();
    // A folder of the report's name: the page is written beside it, and cannot take its place.
    let report = folder.path().join("page.html");
    fs::create_dir_all(report.join("full")).unwrap();
    let message = refusal(&checkpoint, ROLLOUTS, &["--report", text(&report)]);
    assert!(message.contains("page.html"), "{message}");
    assert_eq!(names_in(folder.path()), ["model", "page.html"]);
    assert_eq!(names_in(&report), ["full"]);
}
