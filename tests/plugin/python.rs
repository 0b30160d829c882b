//! The shared library in the real Python wheel: `scripts/tests/plugin`, with checkpoints made here.
#![cfg(mujoco_plugins)]

use std::{
    collections::BTreeSet,
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Each a file of its own, in a process of its own.
const SUBJECTS: [&str; 14] = [
    "added_mass",
    "afloat",
    "effects",
    "examples",
    "force",
    "load_cell",
    "loading",
    "memory",
    "models_of_a_list",
    "own_effects",
    "potential_flow",
    "refusals",
    "robot",
    "vehicles",
];

/// The library that cargo built for this test; the one a folder up is that of the last `cargo build`.
fn library() -> PathBuf {
    let library = env::current_exe()
        .unwrap()
        .with_file_name("libhydro_plugin.so");
    assert!(library.exists(), "{} is not there", library.display());
    library
}

#[test]
fn the_library_in_python() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join(".venv/bin/python");
    if !python.exists() {
        return crate::skip_python::without_venv();
    }
    let folder = tempfile::tempdir().unwrap();
    crate::common::lively(&["fin"]).save(folder.path(), "lively");
    crate::common::memoryless(&["fin"]).save(folder.path(), "memoryless");
    for (number, recipe) in crate::common::zoo(&["fin"]).iter().enumerate() {
        let name = format!("{number}-{}", recipe.model.kind());
        recipe.save(&folder.path().join("kinds"), &name);
    }
    crate::common::constant().save(folder.path(), "constant");
    crate::common::towing().save(folder.path(), "towing");
    let joints: Vec<String> = ["FR", "FL", "RR", "RL"]
        .iter()
        .flat_map(|leg| ["hip", "thigh", "calf"].map(|joint| format!("{leg}_{joint}_joint")))
        .collect();
    let joints: Vec<&str> = joints.iter().map(String::as_str).collect();
    crate::common::lively(&joints).save(folder.path(), "b1");
    let tests = root.join("scripts/tests/plugin");
    let entries = fs::read_dir(&tests).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let found: BTreeSet<String> = names.filter(|name| name.starts_with("test_")).collect();
    let expected = SUBJECTS.map(|subject| format!("test_{subject}.py"));
    assert_eq!(found, BTreeSet::from(expected.clone()));
    for script in expected {
        let script = tests.join(script);
        let status = Command::new(&python)
            .arg(&script)
            .current_dir(folder.path())
            .env("HYDRO_TEST_LIBRARY", library())
            .env("HYDRO_TEST_CHECKPOINTS", folder.path())
            .status()
            .unwrap();
        assert!(status.success(), "{}", script.display());
    }
}
