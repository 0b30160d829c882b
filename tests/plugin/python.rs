//! The shared library in the real Python wheel: `scripts/tests/plugin`, with checkpoints made here.
#![cfg(mujoco_plugins)]

use std::{
    collections::BTreeSet,
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// A test for each subject: a file of its own, in a process of its own.
macro_rules! subjects {
    ($($subject:ident),*) => {
        const SUBJECTS: &[&str] = &[$(stringify!($subject)),*];
        $(
            #[test]
            fn $subject() {
                run(stringify!($subject));
            }
        )*
    };
}
subjects!(
    added_mass,
    afloat,
    effects,
    examples,
    force,
    load_cell,
    loading,
    memory,
    models_of_a_list,
    own_effects,
    potential_flow,
    refusals,
    robot,
    stability,
    vehicles
);

/// The library that cargo built for this test; the one a folder up is that of the last `cargo build`.
fn library() -> PathBuf {
    let library = env::current_exe()
        .unwrap()
        .with_file_name("libhydro_plugin.so");
    assert!(library.exists(), "{} is not there", library.display());
    library
}

/// Folder of the tests in Python.
fn tests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/tests/plugin")
}

/// Checkpoints that the tests in Python load.
fn save_checkpoints(folder: &Path) {
    crate::common::lively(&["fin"]).save(folder, "lively");
    crate::common::memoryless(&["fin"]).save(folder, "memoryless");
    for (number, recipe) in crate::common::zoo(&["fin"]).iter().enumerate() {
        let name = format!("{number}-{}", recipe.model.kind());
        recipe.save(&folder.join("kinds"), &name);
    }
    crate::common::constant().save(folder, "constant");
    crate::common::towing().save(folder, "towing");
    let joints: Vec<String> = ["FR", "FL", "RR", "RL"]
        .iter()
        .flat_map(|leg| ["hip", "thigh", "calf"].map(|joint| format!("{leg}_{joint}_joint")))
        .collect();
    let joints: Vec<&str> = joints.iter().map(String::as_str).collect();
    crate::common::lively(&joints).save(folder, "b1");
}

fn run(subject: &str) {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    if !python.exists() {
        return crate::skip_python::without_venv();
    }
    let folder = tempfile::tempdir().unwrap();
    save_checkpoints(folder.path());
    let script = tests().join(format!("test_{subject}.py"));
    let status = Command::new(&python)
        .arg(&script)
        .current_dir(folder.path())
        .env("HYDRO_TEST_LIBRARY", library())
        .env("HYDRO_TEST_CHECKPOINTS", folder.path())
        .status()
        .unwrap();
    assert!(status.success(), "{}", script.display());
}

#[test]
fn every_subject_is_run() {
    let entries = fs::read_dir(tests()).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let found: BTreeSet<String> = names.filter(|name| name.starts_with("test_")).collect();
    let expected = SUBJECTS.iter().map(|subject| format!("test_{subject}.py"));
    assert_eq!(found, expected.collect());
}
