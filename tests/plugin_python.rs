//! The shared library in the real Python wheel: `scripts/tests/plugin`, with checkpoints made here.
#![cfg(mujoco_plugins)]
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The library that cargo built for this test; the one a folder up is that of the last `cargo build`.
fn library() -> PathBuf {
    let library = env::current_exe()
        .unwrap()
        .with_file_name("libhydro_plugin.so");
    assert!(library.exists(), "{} is not there", library.display());
    library
}

#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn skip(reason: &str) {
    eprintln!("skipped: {reason}");
}

#[test]
fn the_library_in_python() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join(".venv/bin/python");
    if !python.exists() {
        return skip("no .venv (python3 -m venv .venv && .venv/bin/pip install mujoco numpy)");
    }
    let folder = tempfile::tempdir().unwrap();
    common::lively(&["fin"]).save(folder.path(), "lively");
    common::memoryless(&["fin"]).save(folder.path(), "memoryless");
    common::constant().save(folder.path(), "constant");
    common::towing().save(folder.path(), "towing");
    let joints: Vec<String> = ["FR", "FL", "RR", "RL"]
        .iter()
        .flat_map(|leg| ["hip", "thigh", "calf"].map(|joint| format!("{leg}_{joint}_joint")))
        .collect();
    let joints: Vec<&str> = joints.iter().map(String::as_str).collect();
    common::lively(&joints).save(folder.path(), "b1");
    let tests = root.join("scripts/tests/plugin");
    let mut scripts: Vec<PathBuf> = fs::read_dir(tests)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            path.file_name()
                .is_some_and(|name| name.to_string_lossy().starts_with("test_"))
        })
        .collect();
    scripts.sort();
    assert!(scripts.len() > 1, "{scripts:?}");
    for script in scripts {
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
