//! A trial, or a table of steady states, as csv.

use hydro_gap::trial;

use super::{folder, refused, robot};

/// Reads a table under either name.
pub fn read(bytes: &[u8]) -> bool {
    let accepted = ["csv/dive.csv", "csv/steady.csv"].map(|name| trial(name, bytes));
    accepted.contains(&true)
}

/// Reads a trial of this name.
pub(super) fn trial(name: &str, bytes: &[u8]) -> bool {
    let path = folder::put(name, bytes);
    match trial::read(&path, &robot::signature()) {
        Ok((_, remarks)) => {
            assert!(remarks.iter().all(|remark| !remark.to_string().is_empty()));
            true
        }
        Err(error) => refused(&error),
    }
}
