//! Which simulations were told that a velocity is out of the network's range: each once, however often it is reset.
//!
//! A simulation is known by the address of the instance's state in its `mjData`.

use std::sync::{Mutex, PoisonError};

static TOLD: Mutex<Vec<usize>> = Mutex::new(Vec::new());

/// True the first time for this state.
pub(crate) fn first_time(state: &[f64]) -> bool {
    let place = state.as_ptr() as usize;
    let mut told = TOLD.lock().unwrap_or_else(PoisonError::into_inner);
    let first = !told.contains(&place);
    if first {
        told.push(place);
    }
    first
}

/// Forgets a state that a new simulation begins with.
pub(crate) fn forget(state: &[f64]) {
    let place = state.as_ptr() as usize;
    let mut told = TOLD.lock().unwrap_or_else(PoisonError::into_inner);
    told.retain(|known| *known != place);
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
