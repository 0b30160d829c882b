//! Warnings that are given once in a process: every `mjData` of a batch would say them again.

use std::collections::BTreeSet;

use parking_lot::Mutex;

use crate::mujoco::ffi::{Api, warn};

/// Warns, unless it was said before.
pub(super) fn tell_once(api: &Api, note: &str) {
    static TOLD: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let news = {
        let mut told = TOLD.lock();
        told.insert(note.to_owned())
    };
    if news {
        warn(api, &format!("plugin hydro.wrench: {note}"));
    }
}
