//! Claims are about entries that exist.

use super::*;

#[test]
fn claims_are_about_entries() {
    let entries = crate::experiment::entries(6, None);
    for (better, worse) in CLAIMS {
        for id in [better, worse] {
            assert!(entries.iter().any(|entry| entry.id == id), "{id}");
        }
    }
}
