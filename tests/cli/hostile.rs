//! Inputs that mean no good, through the real binary: sizes, kinds of files, two runs in one folder, a stop.
#![cfg(feature = "cli")]

use std::{
    ffi::{OsStr, OsString},
    fs,
    os::unix::{ffi::OsStrExt as _, fs::symlink},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    common::tiny::dataset,
    run::{hydro, message, refused},
};
use hydro_files::FolderLock;
use hydro_model::checkpoint::Checkpoint;
use rustix::process::{Pid, Signal, kill_process};

const SHORT: [&str; 8] = [
    "--hidden",
    "8",
    "--epochs",
    "1",
    "--batch",
    "8",
    "--horizon",
    "20",
];

fn refusal(words: &[&OsStr]) -> String {
    let output = hydro(words);
    let text = refused(&output);
    assert_eq!(output.status.code(), Some(1), "{words:?}: {text}");
    text
}

fn train<'a>(data: &'a Path, out: &'a Path, flags: &'a [&'a str]) -> Vec<&'a OsStr> {
    let mut words: Vec<&OsStr> = vec!["train".as_ref(), "--data".as_ref(), data.as_os_str()];
    words.extend::<[&OsStr; 2]>(["--out".as_ref(), out.as_os_str()]);
    words.extend(flags.iter().map(OsStr::new));
    words
}

fn place() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("data"), folder.path().join("model"));
    dataset(&data);
    (folder, data, out)
}

/// Changes the manifest of a data set.
fn edit(data: &Path, change: impl FnOnce(&mut serde_json::Value)) {
    let path = data.join("manifest.json");
    let mut manifest = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    change(&mut manifest);
    fs::write(&path, manifest.to_string()).unwrap();
}

#[test]
fn sizes_of_flags_have_stated_bounds() {
    let (_folder, data, out) = place();
    for (flag, value, expected) in [
        (
            "--latent",
            "1000000000",
            "latent is 1000000000, expected 65536 at most",
        ),
        (
            "--embedding",
            "4294967296",
            "embedding is 4294967296, expected 65536",
        ),
        ("--hidden", "18446744073709551615", "expected 65536 at most"),
        (
            "--hidden",
            "65536,65536,65536",
            "weights, expected 67108864 at most",
        ),
        (
            "--window",
            "1000000000",
            "window is 1000000000 samples, expected 4096",
        ),
        (
            "--epochs",
            "18446744073709551615",
            "expected 1000000 at most",
        ),
    ] {
        let text = refusal(&train(&data, &out, &[flag, value]));
        assert!(text.contains(expected), "{text}");
        assert!(!out.exists());
    }
}

/// Takes the trajectories out of a split of a data set.
fn empty(data: &Path, split: &str) {
    edit(data, |manifest| {
        manifest["splits"][split] = serde_json::json!({"trajectories": 0, "shards": []});
    });
}

#[test]
fn a_split_that_is_missing_costs_no_training_and_is_not_evaluated() {
    let (_folder, data, out) = place();
    empty(&data, "test");
    let output = hydro(&train(&data, &out, &SHORT));
    let text = message(&output);
    assert!(output.status.success(), "{text}");
    assert!(
        text.contains("saved without errors on the test split"),
        "{text}"
    );
    assert!(Checkpoint::load(&out).unwrap().card.metrics.is_null());
    let evaluate = |more: &[&str]| {
        let mut words: Vec<&OsStr> = vec!["evaluate".as_ref(), "--data".as_ref(), data.as_ref()];
        words.extend::<[&OsStr; 2]>(["--checkpoint".as_ref(), out.as_ref()]);
        words.extend(more.iter().map(OsStr::new));
        refusal(&words)
    };
    let text = evaluate(&[]);
    assert!(text.contains("the test split is empty"), "{text}");
    edit(&data, |manifest| manifest["sample_period"] = 0.02.into());
    let text = evaluate(&["--split", "val"]);
    assert!(text.contains("sample_period is 0.02 s, but"), "{text}");
}

#[test]
fn without_a_validation_split_a_checkpoint_is_saved_and_that_is_said() {
    let (_folder, data, out) = place();
    empty(&data, "val");
    let output = hydro(&train(&data, &out, &SHORT));
    let text = message(&output);
    assert!(output.status.success(), "{text}");
    let told = format!("the val split of {} is empty", data.display());
    assert!(text.contains(&told), "{text}");
    assert!(Checkpoint::load(&out).unwrap().card.metrics["pooled"].is_number());
}

#[test]
fn a_force_beyond_all_numbers_is_an_error() {
    let (folder, data, out) = place();
    assert!(hydro(&train(&data, &out, &SHORT)).status.success());
    let mut checkpoint = Checkpoint::load(&out).unwrap();
    checkpoint.card.normaliser.output_std.fill(1e300);
    let huge = folder.path().join("huge");
    checkpoint.save(&huge).unwrap();
    for more in [&[][..], &["--json"]] {
        let mut words: Vec<&OsStr> = vec!["evaluate".as_ref(), "--data".as_ref(), data.as_ref()];
        words.extend::<[&OsStr; 2]>(["--checkpoint".as_ref(), huge.as_ref()]);
        words.extend(more.iter().map(OsStr::new));
        let text = refusal(&words);
        assert!(
            text.contains("huge: an error is inf: the predicted force leaves the range of numbers"),
            "{text}"
        );
    }
}

#[test]
fn data_of_another_robot_are_told_by_the_first_name_that_differs() {
    let (folder, data, out) = place();
    assert!(hydro(&train(&data, &out, &SHORT)).status.success());
    for (field, name, expected) in [
        (
            "features",
            "position.calf",
            "feature 0 (from 0) is `position.calf`, expected `position.thigh` as in",
        ),
        (
            "outputs",
            "torque.y",
            "output 0 (from 0) is `torque.y`, expected `force.x` as in",
        ),
    ] {
        let other = folder.path().join(field);
        dataset(&other);
        edit(&other, |manifest| {
            manifest[field][0] = name.into();
            if field == "outputs" {
                manifest["output_units"][0] = "N m".into();
            }
        });
        let evaluate = ["evaluate", "--checkpoint", "--data"].map(OsStr::new);
        let [evaluate, by_checkpoint, by_data] = evaluate;
        let text = refusal(&[
            evaluate,
            by_checkpoint,
            out.as_ref(),
            by_data,
            other.as_ref(),
        ]);
        assert!(text.contains(expected), "{text}");
        let mut given = OsString::from("other=");
        given.push(&other);
        let results = folder.path().join("results");
        let compare = ["compare", "task2", "--data", "--out", "--beyond"].map(OsStr::new);
        let [compare, task, by_data, by_out, by_beyond] = compare;
        let places = [by_data, data.as_ref(), by_out, results.as_ref()];
        let words = [&[compare, task][..], &places, &[by_beyond, given.as_ref()]];
        let text = refusal(&words.concat());
        assert!(text.contains(&format!("{expected} --data")), "{text}");
    }
}

#[test]
fn two_runs_do_not_meet_in_one_folder() {
    let (folder, data, out) = place();
    let lock = FolderLock::take(&folder.path().join(".model.lock"), "hydro train").unwrap();
    let text = refusal(&train(&data, &out, &SHORT));
    let holder = format!(
        "process {} (hydro train) is at work there",
        std::process::id()
    );
    assert!(text.contains(&holder), "{text}");
    drop(lock);
    assert!(hydro(&train(&data, &out, &SHORT)).status.success());
    assert!(!folder.path().join(".model.lock").exists());
}

#[test]
fn names_that_are_no_utf8_work() {
    let (folder, data, _) = place();
    let out = folder.path().join(OsStr::from_bytes(b"caf\xe9"));
    let output = hydro(&train(&data, &out, &[&SHORT[..], &["--json"]].concat()));
    assert!(output.status.success(), "{}", message(&output));
    Checkpoint::load(&out).unwrap();
    assert!(
        hydro(&[OsStr::new("inspect"), out.as_ref()])
            .status
            .success()
    );
}

#[test]
fn one_sigint_ends_a_step_that_takes_longer() {
    let (_folder, data, out) = place();
    let flags = ["--hidden", "7168,7168,512", "--solver", "rk4"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_hydro"))
        .args(train(&data, &out, &flags))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The first step of this model takes longer than the patience of anybody.
    while !out.with_file_name(".model.lock").exists() {
        assert_eq!(child.try_wait().unwrap(), None, "refused");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(500));
    let pid = Pid::from_child(&child);
    let asked = Instant::now();
    kill_process(pid, Signal::INT).unwrap();
    let status = child.wait().unwrap();
    assert!(!status.success());
    // A second, and what a loaded machine adds.
    assert!(
        asked.elapsed() < Duration::from_secs(3),
        "{:?}",
        asked.elapsed()
    );
}

#[cfg(mujoco_plugins)]
mod gap {
    use super::*;

    const CART: &str = r#"<mujoco><option timestep="0.005"/><worldbody>
      <body><joint name="rail" type="slide" axis="1 0 0"/><geom size="0.1" mass="2"/></body></worldbody>
      <actuator><motor name="pull" joint="rail"/></actuator>
      <sensor><jointpos name="at" joint="rail" noise="0.001"/></sensor></mujoco>"#;

    /// Nominal model, trials, results.
    fn case() -> (tempfile::TempDir, [PathBuf; 3]) {
        let folder = tempfile::tempdir().unwrap();
        let places = ["nominal.xml", "trials", "out"].map(|name| folder.path().join(name));
        fs::write(&places[0], CART).unwrap();
        fs::create_dir(&places[1]).unwrap();
        for name in ["a", "b"] {
            let rows = (0..50).map(|k| format!("\n{:.3},0.1,0", 0.01 * f64::from(k)));
            let text = "time,pull,at".to_owned() + &rows.collect::<String>();
            fs::write(places[1].join(format!("{name}.csv")), text).unwrap();
        }
        (folder, places)
    }

    fn find([model, trials, out]: &[PathBuf; 3]) -> String {
        let words = ["gap", "find", "--model", "--trials", "--out"].map(OsString::from);
        let [gap, find, by_model, by_trials, by_out] = &words;
        refusal(&[
            gap,
            find,
            by_model,
            model.as_ref(),
            by_trials,
            trials.as_ref(),
            by_out,
            out.as_ref(),
        ])
    }

    #[test]
    fn a_nominal_that_could_not_be_edited_is_refused_at_the_start() {
        let (_folder, places) = case();
        for (text, expected) in [
            (format!("<!DOCTYPE mujoco>{CART}"), "remove the <!DOCTYPE"),
            (
                CART.replace("0.005", "0"),
                "the timestep of its <option> is 0 s",
            ),
            (
                CART.replace("0.005", "1e-300"),
                "is 1e-300 s, expected from 1e-6",
            ),
            (
                CART.replace("<worldbody>", "<include file=\"/dev/zero\"/><worldbody>"),
                "includes /dev/zero: is a device; expected a file",
            ),
        ] {
            fs::write(&places[0], text).unwrap();
            let _ = fs::remove_dir_all(&places[2]);
            let text = find(&places);
            assert!(text.contains(expected), "{text}");
        }
        fs::remove_file(&places[0]).unwrap();
        symlink("/dev/zero", &places[0]).unwrap();
        assert!(find(&places).contains("is a device; expected a file"));
    }

    #[test]
    fn a_trial_that_is_no_file_is_not_left_out() {
        let (_folder, places) = case();
        symlink("/dev/zero", places[1].join("c.npz")).unwrap();
        let text = find(&places);
        assert!(
            text.contains("c.npz: is a device; expected a file"),
            "{text}"
        );
    }

    #[test]
    fn two_runs_do_not_meet_in_one_folder() {
        let (_folder, places) = case();
        fs::create_dir(&places[2]).unwrap();
        let _lock = FolderLock::take(&places[2].join(".lock"), "hydro gap run").unwrap();
        let text = find(&places);
        assert!(text.contains("(hydro gap run) is at work there"), "{text}");
    }

    #[test]
    fn names_that_are_no_utf8_are_refused_at_the_start() {
        let (folder, [model, trials, _]) = case();
        let out = folder.path().join(OsStr::from_bytes(b"caf\xe9"));
        let text = find(&[model, trials, out]);
        assert!(
            text.contains("--out") && text.contains("no UTF-8 text"),
            "{text}"
        );
    }
}
