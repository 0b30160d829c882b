//! Simulations that were warned that a velocity is out of the network's range: each once, however often it is reset.
//!
//! A simulation is known by the address of the instance's entry in `plugin_data` of its `mjData`; `destroy` forgets it.

use std::sync::{Mutex, PoisonError};

static WARNED: Mutex<Vec<usize>> = Mutex::new(Vec::new());

/// True the first time for this entry.
pub(crate) fn first_time(entry: &usize) -> bool {
    let address = std::ptr::from_ref(entry) as usize;
    let mut warned = WARNED.lock().unwrap_or_else(PoisonError::into_inner);
    let first = !warned.contains(&address);
    if first {
        warned.push(address);
    }
    first
}

/// Forgets an entry, of a simulation that begins or ends.
pub(crate) fn forget(entry: &usize) {
    let address = std::ptr::from_ref(entry) as usize;
    let mut warned = WARNED.lock().unwrap_or_else(PoisonError::into_inner);
    warned.retain(|known| *known != address);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simulation_is_warned_once_until_it_is_made_anew() {
        let (one, other) = (0, 0);
        assert!(first_time(&one) && first_time(&other));
        assert!(!first_time(&one));
        forget(&one);
        assert!(first_time(&one) && !first_time(&other));
    }
}
