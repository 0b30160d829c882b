//! Which room may name which, held by program and not by memory (see ARCHITECTURE.md).
#![allow(missing_docs, clippy::unwrap_used)]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// A room and the rooms that it may name.
const MAY_NAME: &[(&str, &[&str])] = &[
    ("document", &[]),
    ("frames", &[]),
    ("features", &[]),
    ("kinematics", &["features"]),
    ("drag", &["frames"]),
    ("envelope", &["features"]),
    ("robot", &["frames"]),
    ("effects", &["frames"]),
    ("sim", &["effects", "frames"]),
    ("trial", &["frames"]),
    ("patch", &["effects", "sim"]),
    ("rollouts", &["document", "features"]),
    ("dataset", &["document", "features", "frames", "kinematics"]),
    ("model", &["features", "frames", "kinematics"]),
    (
        "checkpoint",
        &["document", "envelope", "features", "frames", "model"],
    ),
    (
        "training",
        &[
            "checkpoint",
            "dataset",
            "document",
            "envelope",
            "features",
            "frames",
            "model",
        ],
    ),
    (
        "plugin",
        &[
            "checkpoint",
            "document",
            "effects",
            "envelope",
            "features",
            "frames",
            "model",
        ],
    ),
    (
        "mujoco",
        &[
            "checkpoint",
            "effects",
            "features",
            "frames",
            "model",
            "plugin",
            "sim",
        ],
    ),
    (
        "comparison",
        &[
            "checkpoint",
            "dataset",
            "drag",
            "features",
            "frames",
            "model",
            "rollouts",
            "sim",
            "training",
        ],
    ),
    (
        "experiment",
        &[
            "checkpoint",
            "comparison",
            "dataset",
            "features",
            "kinematics",
            "model",
            "training",
        ],
    ),
    ("gap", &["effects", "frames", "robot", "sim", "trial"]),
    (
        "report",
        &["comparison", "effects", "experiment", "gap", "training"],
    ),
];

/// Rooms that may name every other: the command line is where all meets.
const ROOF: &[&str] = &["cli", "lib", "main"];

fn sources() -> Vec<(String, PathBuf, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    walk(&root, &mut found);
    found.sort();
    assert!(found.len() > 10, "the walk found only {found:?}");
    found
        .into_iter()
        .map(|path| {
            let inside = path.strip_prefix(&root).unwrap();
            let first = inside.iter().next().unwrap().to_str().unwrap();
            let room = first.trim_end_matches(".rs").to_owned();
            let text = fs::read_to_string(&path).unwrap();
            (room, path, text)
        })
        .collect()
}

/// Source without comments, so that a doc link is no dependency.
fn code(text: &str) -> String {
    text.lines()
        .map(|line| line.split("//").next().unwrap_or(""))
        .collect::<Vec<_>>()
        .join("\n")
}

/// Every room named as `crate::room`, alone or in a `crate::{...}` group.
fn named_rooms(code: &str) -> BTreeSet<String> {
    let mut rooms = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut word = String::new();
            let mut at_head = true;
            for c in group.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => at_head = true,
                    c if depth == 0 && at_head && (c.is_alphanumeric() || c == '_') => word.push(c),
                    c if !c.is_whitespace() => {
                        at_head = false;
                    }
                    _ => {}
                }
                if (!at_head || c == ',') && !word.is_empty() {
                    rooms.insert(std::mem::take(&mut word));
                }
            }
            if !word.is_empty() {
                rooms.insert(word);
            }
        } else {
            let name = rest.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            rooms.extend(name.take(1).map(str::to_owned));
        }
    }
    rooms
}

#[test]
fn the_reader_of_names_sees_groups_and_paths() {
    let rooms = named_rooms("use crate::{a::B, c::{D, e::F},\n g};\nlet x = crate::h::i();");
    assert_eq!(rooms.into_iter().collect::<Vec<_>>(), ["a", "c", "g", "h"]);
}

#[test]
fn every_room_names_only_rooms_below_it() {
    let allowed: BTreeMap<&str, &[&str]> = MAY_NAME.iter().copied().collect();
    let mut faults = Vec::new();
    for (room, path, text) in sources() {
        if ROOF.contains(&room.as_str()) {
            continue;
        }
        let Some(may) = allowed.get(room.as_str()) else {
            faults.push(format!(
                "{}: the room `{room}` is not in this test",
                path.display()
            ));
            continue;
        };
        for named in named_rooms(&code(&text)) {
            let known = allowed.contains_key(named.as_str()) || ROOF.contains(&named.as_str());
            if known && named != room && !may.contains(&named.as_str()) {
                faults.push(format!(
                    "{}: `{room}` must not name `{named}`",
                    path.display()
                ));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn unsafe_code_stands_only_in_the_mujoco_room() {
    for (room, path, text) in sources() {
        if room != "mujoco" {
            for word in ["unsafe {", "unsafe fn", "unsafe impl", "unsafe extern"] {
                assert!(!code(&text).contains(word), "{}: `{word}`", path.display());
            }
        }
    }
}

#[test]
fn only_the_command_line_prints_exits_and_parses_flags() {
    for (room, path, text) in sources() {
        if !["cli", "main"].contains(&room.as_str()) {
            for word in ["println!", "print!(", "process::exit", "clap::", "anyhow::"] {
                assert!(!code(&text).contains(word), "{}: `{word}`", path.display());
            }
        }
    }
}
