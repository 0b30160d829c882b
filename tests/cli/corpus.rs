//! Every input of `fuzz/corpus` through its target, as the fuzzer calls it: no panic, in a moment, and the sound ones accepted.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

#[path = "../../fuzz/src/lib.rs"]
mod targets;

/// Longest time that an input of a few kB may take, unoptimised and on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(10);

fn names(folder: &Path) -> Vec<PathBuf> {
    let entries =
        fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

#[test]
fn every_input_of_the_corpus_is_refused_or_accepted() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let mut known = Vec::new();
    for (name, read) in targets::TARGETS {
        let folder = corpus.join(name);
        let mut accepted = 0;
        for path in names(&folder) {
            let bytes = fs::read(&path).unwrap();
            let started = Instant::now();
            accepted += usize::from(read(&bytes));
            let took = started.elapsed();
            assert!(took < PATIENCE, "{}: {took:?}", path.display());
        }
        assert!(
            accepted > 0,
            "{name}: no input is accepted, so the corpus reaches little"
        );
        known.push(folder);
    }
    assert_eq!(names(&corpus), known, "a folder without a target");
}
