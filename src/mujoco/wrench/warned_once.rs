//! Which simulations were warned that a velocity is out of the network's range: each once, however often it is reset.
//!
//! A simulation is known by the address of the instance's state in its `mjData`.

use std::sync::{Mutex, PoisonError};

static WARNED: Mutex<Vec<usize>> = Mutex::new(Vec::new());

/// True the first time for this state.
pub(crate) fn first_time(state: &[f64]) -> bool {
    let place = state.as_ptr() as usize;
    let mut warned = WARNED.lock().unwrap_or_else(PoisonError::into_inner);
    let first = !warned.contains(&place);
    if first {
        warned.push(place);
    }
    first
}

/// Forgets a state, for a new simulation begins at its address.
pub(crate) fn forget(state: &[f64]) {
    let place = state.as_ptr() as usize;
    let mut warned = WARNED.lock().unwrap_or_else(PoisonError::into_inner);
    warned.retain(|known| *known != place);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simulation_is_told_once_until_it_is_made_anew() {
        let (one, other) = ([0.0], [0.0]);
        assert!(first_time(&one) && first_time(&other));
        assert!(!first_time(&one));
        forget(&one);
        assert!(first_time(&one) && !first_time(&other));
    }
}
