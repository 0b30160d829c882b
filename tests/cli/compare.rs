//! `hydro compare` from end to end on a small data set: jobs, what is done again and what is not, tables, refusals.
#![cfg(feature = "cli")]

use std::{
    fs,
    io::Read as _,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    time::Duration,
};

use crate::{common::tiny::dataset, run::refused};
use hydro_files::FolderLock;
use serde_json::Value;

/// Rows that are trained quickly.
const ENTRIES: [&str; 2] = ["--entries", "relaxation-ode,lstm"];

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        dataset(&folder.path().join("data"));
        Self { folder }
    }

    /// With times of both rows, so that none are taken: in a debug build that is most of the work.
    fn timed() -> Self {
        let place = Self::new();
        let three = |ms: f64| serde_json::json!({ "median": ms, "quartiles": [ms, ms] });
        let costs = ["relaxation-ode", "lstm"].map(|entry| {
            serde_json::json!({
                "entry": entry, "machine": "none", "stepped": three(2.0), "one": three(1.0), "many": three(30.0),
            })
        });
        fs::create_dir(place.out()).unwrap();
        fs::write(
            place.out().join("cost.json"),
            serde_json::json!({ "2": costs }).to_string(),
        )
        .unwrap();
        place
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn command(&self, more: &[&str]) -> Command {
        let usual = |flag: &str, words: &'static [&'static str]| {
            if more.contains(&flag) { &[] } else { words }
        };
        let mut command = Command::new(env!("CARGO_BIN_EXE_hydro"));
        command
            .args(["compare", "task2", "--data"])
            .arg(self.folder.path().join("data"))
            .arg("--out")
            .arg(self.out())
            .args(usual("--epochs", &["--epochs", "1"]))
            .args(usual("--entries", &ENTRIES))
            .args(more);
        command
    }

    fn compare(&self, more: &[&str]) -> Output {
        self.command(more).output().unwrap()
    }

    fn succeeds(&self, more: &[&str]) -> String {
        let output = self.compare(more);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{more:?}: {errors}");
        String::from_utf8(output.stdout).unwrap()
    }

    fn refusal(&self, more: &[&str]) -> String {
        refused(&self.compare(more))
    }
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn jobs_are_done_once_and_the_tables_hold_all_seeds() {
    let place = Place::timed();
    let listed = place.succeeds(&["--seeds", "0,1", "--list"]);
    assert_eq!(
        listed.lines().collect::<Vec<_>>(),
        [
            "2/lstm/seed-0",
            "2/relaxation-ode/seed-0",
            "2/lstm/seed-1",
            "2/relaxation-ode/seed-1"
        ]
    );
    let text = place.succeeds(&["--seeds", "0"]);
    assert!(
        text.contains("| LSTM |") && text.contains("2 of 2 jobs done"),
        "{text}"
    );
    let first = place.out().join("jobs/2/lstm/seed-0/result.json");
    let before = fs::metadata(&first).unwrap().modified().unwrap();

    let beyond = format!("fast={}", place.folder.path().join("data").display());
    let summary = place.succeeds(&["--seeds", "0,1", "--json"]);
    let summary: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(before, fs::metadata(&first).unwrap().modified().unwrap());
    for row in summary["rows"].as_array().unwrap() {
        assert_eq!(row["seeds"], serde_json::json!([0, 1]), "{row}");
        let nrmse = &row["values"]["nrmse"];
        assert_eq!(nrmse["count"], 2);
        assert!(
            nrmse["sd"].as_f64().unwrap() > 0.0,
            "two seeds are two trainings: {nrmse}"
        );
        assert!(row["cost"]["one"]["median"].as_f64().unwrap() > 0.0);
        assert_eq!(
            row["example"].as_array().unwrap().len(),
            crate::common::tiny::T
        );
    }
    let claims = summary["orderings"].as_array().unwrap();
    assert_eq!(
        claims.len(),
        1,
        "of the claims one is about these two: {claims:?}"
    );
    let page = fs::read_to_string(place.out().join("README.md")).unwrap();
    for line in page.lines().filter(|line| line.starts_with("![")) {
        let file = line.split(['(', ')']).nth(1).unwrap();
        let svg = fs::read_to_string(place.out().join(file)).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.contains("polyline"),
            "{file}"
        );
    }

    // Asked about other data too, a model is examined again and not trained again.
    let weights = place
        .out()
        .join("jobs/2/lstm/seed-0/checkpoint/weights.safetensors");
    let trained = fs::metadata(&weights).unwrap().modified().unwrap();
    place.succeeds(&["--seeds", "0,1", "--beyond", &beyond]);
    assert_eq!(trained, fs::metadata(&weights).unwrap().modified().unwrap());
    let result = json(&first);
    let inside = result["examination"]["starts"]["clean"]["pooled"]
        .as_f64()
        .unwrap();
    let outside = result["examination"]["beyond"][0]["pooled"]
        .as_f64()
        .unwrap();
    assert!(
        (inside - outside).abs() < 1e-12,
        "the same data under another name: {inside} {outside}"
    );
}

#[test]
fn the_same_seed_gives_the_same_figures_wherever_a_job_runs() {
    let (here, there) = (Place::timed(), Place::timed());
    here.succeeds(&["--seeds", "3", "--parallel", "1"]);
    there.succeeds(&["--seeds", "3", "--only", "2/lstm/seed-3"]);
    let of = |place: &Place| {
        let mut result = json(&place.out().join("jobs/2/lstm/seed-3/result.json"));
        result.as_object_mut().unwrap().remove("training");
        result
    };
    assert_eq!(of(&here), of(&there));
}

/// Ctrl-C in the middle of a training: nothing is lost, and the same command goes on to the same model.
#[test]
fn an_interrupted_comparison_goes_on_to_the_same_results() {
    let flags = [
        "--seeds",
        "0",
        "--epochs",
        "150",
        "--entries",
        "relaxation-ode",
    ];
    let (whole, cut) = (Place::timed(), Place::timed());
    whole.succeeds(&flags);
    let mut child = cut
        .command(&flags)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let job = cut.out().join("jobs/2/relaxation-ode/seed-0");
    for _ in 0..400 {
        if job.join("run/state.safetensors").exists() {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    let mut words = String::new();
    let mut stderr = child.stderr.take().unwrap();
    stderr.read_to_string(&mut words).unwrap();
    // A very fast machine may finish first, and then there is nothing to go on with, which must hold too.
    if !child.wait().unwrap().success() {
        assert!(!job.join("result.json").exists());
        assert!(words.contains("the same command goes on"), "{words}");
    }
    let begun = !job.join("result.json").exists() && job.join("run/state.safetensors").exists();
    let again = cut.compare(&flags);
    let words = String::from_utf8_lossy(&again.stderr);
    assert!(again.status.success(), "{words}");
    assert_eq!(words.contains("0 done already, 1 begun"), begun, "{words}");
    // Killed while it wrote its tables, it has no job left, and says so.
    let done = cut.compare(&flags);
    let words = String::from_utf8_lossy(&done.stderr);
    assert!(words.contains("1 done already"), "{words}");
    let of = |place: &Place| json(&place.out().join("jobs/2/relaxation-ode/seed-0/result.json"));
    let (whole, cut) = (of(&whole), of(&cut));
    assert_eq!(whole["examination"], cut["examination"]);
    assert_eq!(whole["training"]["epochs"], cut["training"]["epochs"]);
}

/// Killed, the command takes its jobs with it: a second one would train beside them in the same folder.
#[test]
fn a_killed_comparison_leaves_no_job_at_work() {
    let place = Place::timed();
    let mut parent = place
        .command(&[
            "--seeds",
            "0",
            "--epochs",
            "100000",
            "--entries",
            "relaxation-ode",
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let job = place.out().join("jobs/2/relaxation-ode/seed-0");
    wait_until(|| job.join("run/state.safetensors").exists());
    let holder = fs::read_to_string(job.join(".lock")).unwrap();
    assert!(
        !holder.starts_with(&format!("{} ", parent.id())),
        "{holder}"
    );
    parent.kill().unwrap();
    parent.wait().unwrap();
    wait_until(|| FolderLock::take(&job.join(".lock"), "test").is_ok());
}

/// Waits for a condition, a minute at most.
fn wait_until(condition: impl Fn() -> bool) {
    for _ in 0..6000 {
        if condition() {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("not within a minute");
}

#[test]
fn a_job_that_another_process_does_is_refused_with_its_name() {
    let place = Place::timed();
    let job = place.out().join("jobs/2/lstm/seed-0");
    fs::create_dir_all(&job).unwrap();
    let _lock = FolderLock::take(&job.join(".lock"), "another").unwrap();
    let text = place.refusal(&["--seeds", "0", "--only", "2/lstm/seed-0"]);
    let holder = format!("process {} (another) is at work there", std::process::id());
    assert!(text.contains(&holder), "{text}");
    let text = place.refusal(&["--seeds", "0", "--only", "2/lstm/seed-0", "--parent", "1"]);
    assert!(text.contains("process 1 began it"), "{text}");
}

#[test]
fn a_folder_in_which_another_process_compares_is_refused_with_its_name() {
    let place = Place::timed();
    let _lock = FolderLock::take(&place.out().join(".lock"), "hydro compare task1").unwrap();
    for more in [&[][..], &["--tables"]] {
        let text = place.refusal(&[&["--seeds", "0"], more].concat());
        let holder = format!(
            "--out {}: wait, or choose another: process {} (hydro compare task1) is at work there",
            place.out().display(),
            std::process::id()
        );
        assert!(text.contains(&holder), "{text}");
    }
    assert!(!place.out().join("jobs").exists());
}

#[test]
fn results_of_other_settings_are_kept_and_refused() {
    let place = Place::timed();
    place.succeeds(&["--seeds", "0", "--entries", "lstm"]);
    let result = place.out().join("jobs/2/lstm/seed-0/result.json");
    let before = fs::read(&result).unwrap();
    let message = place.refusal(&["--seeds", "0", "--entries", "lstm", "--trajectories", "5"]);
    assert!(
        message.contains("result.json: made with other settings: trajectories is null, expected 5"),
        "{message}"
    );
    assert_eq!(before, fs::read(&result).unwrap());
    // Trained, and interrupted before it was examined: its checkpoint is of other settings all the same.
    fs::remove_file(&result).unwrap();
    let message = place.refusal(&["--seeds", "0", "--entries", "lstm", "--trajectories", "5"]);
    assert!(
        message
            .contains("training.json: made with other settings: trajectories is null, expected 5"),
        "{message}"
    );
    place.succeeds(&["--seeds", "0", "--entries", "lstm"]);
    // Other data of the same settings.
    let manifest = place.folder.path().join("data/manifest.json");
    let bytes = fs::read(&manifest).unwrap();
    fs::write(&manifest, [&bytes[..], b"\n"].concat()).unwrap();
    let message = place.refusal(&["--seeds", "0", "--entries", "lstm"]);
    let words = "result.json: made with other data: its manifest.json has the sha256 ";
    assert!(message.contains(words), "{message}");
    fs::write(&manifest, bytes).unwrap();
    // What cannot be read is named.
    fs::write(&result, "{\"schema\": \"hydro-compare-job/1\"}").unwrap();
    let message = place.refusal(&["--seeds", "0", "--entries", "lstm"]);
    assert!(message.contains("not the result of a job"), "{message}");
}

/// Another rate than a row's own reaches the training, in a process of its own too.
#[test]
fn a_learning_rate_replaces_that_of_every_row() {
    let place = Place::timed();
    place.succeeds(&["--seeds", "0", "--learning-rate", "0.0005"]);
    for entry in ["lstm", "relaxation-ode"] {
        let result = json(
            &place
                .out()
                .join(format!("jobs/2/{entry}/seed-0/result.json")),
        );
        assert_eq!(result["settings"]["learning_rate"], 0.0005, "{entry}");
    }
}

/// A job that cannot be done stops nobody, is named at the end, and the tables hold the others.
#[test]
fn a_job_that_fails_does_not_end_the_night() {
    let place = Place::timed();
    let folder = place.out().join("jobs/2/lstm/seed-0");
    fs::create_dir_all(folder.join("checkpoint")).unwrap();
    fs::write(folder.join("checkpoint/card.json"), "{}").unwrap();
    let message = place.refusal(&["--seeds", "0", "--parallel", "1"]);
    assert!(
        message.contains(
            "1 of 2 jobs failed: 2/lstm/seed-0 failed (exit status: 1); its last lines: "
        ) && message.contains("card.json"),
        "{message}"
    );
    let page = fs::read_to_string(place.out().join("README.md")).unwrap();
    assert!(page.contains("| LSTM | \u{2013} |"), "{page}");
    // Times are of everybody in one go, or of nobody.
    let output = place.compare(&["--seeds", "0", "--tables", "--retime"]);
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success()
            && words.contains("no times are taken")
            && words.contains("no weights of lstm;"),
        "{words}"
    );
    assert!(
        place
            .out()
            .join("jobs/2/relaxation-ode/seed-0/result.json")
            .exists()
    );
}

/// Results that came without their weights: fixed steps take as long with any.
#[test]
fn times_are_taken_without_trained_weights() {
    let place = Place::timed();
    place.succeeds(&["--seeds", "0"]);
    for entry in ["lstm", "relaxation-ode"] {
        let job = place.out().join(format!("jobs/2/{entry}/seed-0"));
        fs::remove_dir_all(job.join("checkpoint")).unwrap();
    }
    let path = place.out().join("cost.json");
    fs::remove_file(&path).unwrap();
    place.succeeds(&["--seeds", "0", "--tables"]);
    let costs = json(&path);
    let timed: Vec<_> = costs["2"].as_array().unwrap().iter().collect();
    assert_eq!(timed.len(), 2);
    for cost in timed {
        assert!(cost["stepped"]["median"].as_f64().unwrap() > 0.0, "{cost}");
    }
}

#[test]
fn flags_that_mean_nothing_are_named() {
    let place = Place::new();
    for (flags, words) in [
        (
            vec!["--entries", "gru"],
            "unknown `gru`; there are mlp-ode-euler",
        ),
        (
            vec!["--only", "2/lstm/seed-9"],
            "no such job; there are 2/lstm/seed-0",
        ),
        (vec!["--only", "lstm"], "expected DATA/ENTRY/seed-N"),
        (vec!["--beyond", "fast"], "expected NAME=FOLDER"),
        (vec!["--beyond", "fast=/nowhere"], "no data set at /nowhere"),
        (vec!["--rollouts", "/nowhere"], "/nowhere/rollouts.json"),
        (vec!["--parallel", "0"], "--parallel"),
        (vec!["--epochs", "0"], "epochs is 0"),
        (
            vec!["--learning-rate", "0"],
            "learning_rate is 0, expected above 0 and at most 1",
        ),
    ] {
        let message = place.refusal(&flags);
        assert!(message.contains(words), "{flags:?}: {message}");
    }
    if cfg!(mujoco_plugins) {
        let message = place.refusal(&["--rollouts", "tests/data/rollouts"]);
        let words = "tests/data/rollouts: feature 0 (from 0) is `position.FR_hip_joint`, expected \
                     `position.thigh` as in --data";
        assert!(message.contains(words), "{message}");
    }
    // Towed robots do not swim.
    for flag in ["--rollouts", "--beyond"] {
        let output = Command::new(env!("CARGO_BIN_EXE_hydro"))
            .args([
                "compare", "task1", "--data", "/nowhere", "--out", "/nowhere",
            ])
            .args([flag, "fast=/nowhere"])
            .output()
            .unwrap();
        let message = refused(&output);
        let words = format!("{flag}: for task2 alone");
        assert!(message.contains(&words), "{message}");
    }
}
