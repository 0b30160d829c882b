//! Counts of MuJoCo's warnings for the program `hydro`: an unstable simulation gives one at every step.
//!
//! MuJoCo prints a warning unless the variable `mju_user_warning` holds a handler. Only a program that calls [`count`]
//! installs one; the plugin leaves the host's handler alone.

use std::{
    collections::BTreeMap,
    ffi::{CStr, c_char},
    sync::OnceLock,
};

use parking_lot::Mutex;

use super::{api::Api, boundary::guard};

/// Start of this library's own warnings.
const OWN: &str = "hydro:";

type Handler = unsafe extern "C" fn(*const c_char);

/// Shows this library's own warnings; set once warnings are counted.
static SHOW: OnceLock<fn(&str)> = OnceLock::new();
static COUNTS: Mutex<BTreeMap<String, u64>> = Mutex::new(BTreeMap::new());

/// From now on counts MuJoCo's warnings by kind instead of printing them; `show` gets this library's own.
pub fn count(show: fn(&str)) {
    SHOW.get_or_init(|| show);
    Api::on_load(install);
}

/// The kinds of MuJoCo's warnings since the last call and their counts, the most frequent first.
pub fn take_counts() -> Vec<(String, u64)> {
    let counts = std::mem::take(&mut *COUNTS.lock());
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    counts
}

/// Makes [`handle`] MuJoCo's handler of warnings.
fn install(api: &Api) {
    // SAFETY: the type is that of mujoco.h; a function pointer and none have the layout of `Option<Handler>`. It is
    // written before any simulation of this program runs.
    unsafe {
        if let Some(handler) = api.variable::<Option<Handler>>(b"mju_user_warning\0") {
            *handler = Some(handle);
        }
    }
}

unsafe extern "C" fn handle(text: *const c_char) {
    guard("warning", (), || {
        if text.is_null() {
            return;
        }
        // SAFETY: MuJoCo passes a C string that lives during the call.
        let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
        match SHOW.get() {
            Some(show) if text.starts_with(OWN) => show(&text),
            _ => {
                let mut counts = COUNTS.lock();
                *counts.entry(kind(&text)).or_default() += 1;
            }
        }
    });
}

/// The first sentence of a warning, with `*` for every number.
fn kind(text: &str) -> String {
    let sentence = text.split(". ").next().unwrap_or(text).trim();
    let words = sentence.split_whitespace().map(|word| {
        let bare = word.trim_matches(|c: char| c.is_ascii_punctuation());
        match bare.parse::<f64>() {
            Ok(_) if bare.starts_with(|c: char| c.is_ascii_digit()) => word.replace(bare, "*"),
            _ => word.to_owned(),
        }
    });
    let words: Vec<String> = words.collect();
    words.join(" ").trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::{
        sync::Arc,
        sync::atomic::{AtomicUsize, Ordering},
    };

    use super::*;
    use crate::mujoco::{
        ffi::warn,
        simulator::{Data, Model},
    };

    static SHOWN: AtomicUsize = AtomicUsize::new(0);

    #[test]
    fn a_kind_has_no_numbers() {
        let text =
            "Nan, Inf or huge value in QACC at DOF 12. The simulation is unstable. Time = 0.0020.";
        assert_eq!(
            kind(text),
            "Nan, Inf or huge value in QACC at DOF *",
            "{text}"
        );
        assert_eq!(kind("Too many contacts (64)."), "Too many contacts (*)");
    }

    #[test]
    fn warnings_of_an_unstable_simulation_are_counted_and_our_own_are_shown() {
        count(|text| {
            assert!(text.starts_with(OWN));
            SHOWN.fetch_add(1, Ordering::Relaxed);
        });
        let text =
            "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
        let model = Arc::new(Model::from_xml(text).unwrap());
        for _ in 0..3 {
            let mut data = Data::new(&model).unwrap();
            data.qvel_mut()[0] = 1e30;
            data.step();
        }
        warn(Api::get().unwrap(), "a warning of our own");
        assert!(SHOWN.load(Ordering::Relaxed) >= 1);
        let counts = take_counts();
        let unstable = counts.iter().find(|(kind, _)| kind.contains("QVEL"));
        let (kind, count) = unstable.unwrap();
        assert!(kind.ends_with("at DOF *"), "{kind}");
        assert!(*count >= 3, "{counts:?}");
    }
}
