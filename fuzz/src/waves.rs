//! `hydro-waves/1`. What is accepted moves with finite velocities, no higher than it says.

use hydro_effects::sea::WaveField;

use super::refused;

const GRAVITY: f64 = 9.81;

/// Reads waves.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    match WaveField::parse(text, GRAVITY) {
        Ok((waves, notes)) => {
            look(&waves);
            assert!(notes.iter().all(|note| !note.to_string().is_empty()));
            true
        }
        Err(error) => refused(&error),
    }
}

/// Looks at waves in a few places.
pub(super) fn look(waves: &WaveField) {
    assert!(waves.shortest_length() > 0.0 && waves.peak().length > 0.0);
    for (point, time) in [
        ([0.0; 3], 0.0),
        ([1.0, -2.0, -0.3], 4.0),
        ([1e6, -1e6, 20.0], 1e9),
    ] {
        let water = waves.kinematics(point, time);
        let pressure = waves.pressure(point, time);
        let numbers = [&water.velocity[..], &water.acceleration[..], &[pressure]].concat();
        assert!(
            numbers.iter().all(|number| number.is_finite()),
            "{numbers:?} at {point:?}, {time} s"
        );
        let highest = waves.highest() * (1.0 + 1e-12) + 1e-300;
        assert!(water.elevation.abs() <= highest, "{} m", water.elevation);
    }
}
