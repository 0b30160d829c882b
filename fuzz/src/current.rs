//! `hydro-current/1`. What is accepted is finite at every place, depth and time.

use hydro_effects::sea::CurrentField;

use super::refused;

/// Reads a current.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    match CurrentField::parse(text) {
        Ok(current) => {
            look(&current);
            true
        }
        Err(error) => refused(&error),
    }
}

/// Looks at a current in a few places, while its random part goes on.
pub(super) fn look(current: &CurrentField) {
    let mut state = vec![0.0; current.state_len()];
    for (place, depth, time) in [
        ([0.0, 0.0], 0.0, 0.0),
        ([3.0, -2.0], 2.0, 1.0),
        ([1e6, -1e6], -1e3, 1e9),
    ] {
        let velocity = current.velocity(place, depth, time, &state);
        assert!(
            velocity.iter().all(|speed| speed.is_finite()),
            "{velocity:?} at {place:?}, {depth} m, {time} s"
        );
        current.advance(&mut state, 0.01);
        // What a program sets is its own affair.
        if let Some([.., set]) = state
            .last_chunk_mut::<3>()
            .filter(|_| current.is_settable())
        {
            *set = f64::NAN;
        }
    }
}
