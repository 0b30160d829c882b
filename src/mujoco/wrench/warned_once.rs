//! Simulations that were warned of something: each once, however often it is reset.
//!
//! A simulation is known by the address of the instance's entry in `plugin_data` of its `mjData`; `destroy` forgets it.

use parking_lot::Mutex;

/// Cause of a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A velocity is out of the network's range.
    OutOfRange,
    /// The force of an effect is not a finite number.
    NotFinite,
}

static WARNED: Mutex<Vec<(usize, Cause)>> = Mutex::new(Vec::new());

/// True the first time for this entry and cause.
pub(crate) fn first_time(entry: &usize, cause: Cause) -> bool {
    let one = (std::ptr::from_ref(entry) as usize, cause);
    let mut warned = WARNED.lock();
    let first = !warned.contains(&one);
    if first {
        warned.push(one);
    }
    first
}

/// Forgets an entry, of a simulation that begins or ends.
pub(crate) fn forget(entry: &usize) {
    let address = std::ptr::from_ref(entry) as usize;
    let mut warned = WARNED.lock();
    warned.retain(|(known, _)| *known != address);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simulation_is_warned_once_until_it_is_made_anew() {
        let (one, other) = (0, 0);
        let first_time = |entry| first_time(entry, Cause::OutOfRange);
        assert!(first_time(&one) && first_time(&other));
        assert!(!first_time(&one));
        assert!(super::first_time(&one, Cause::NotFinite));
        forget(&one);
        assert!(first_time(&one) && !first_time(&other));
    }
}
