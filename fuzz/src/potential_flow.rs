//! `hydro-potential-flow/1`. What is accepted has a memory that can be stepped, and forces that are finite.

use hydro_effects::{potential_flow::PotentialFlow, sea::WaveField};

use super::refused;

const WAVES: &str =
    r#"{"schema": "hydro-waves/1", "components": [{"height": 1, "period": 5, "direction": 30}]}"#;

/// Reads the coefficients of a hull.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    match PotentialFlow::parse(text) {
        Ok(flow) => {
            look(&flow);
            true
        }
        Err(error) => refused(&error),
    }
}

/// Steps the memory from rest, and looks at the force of a wave.
pub(super) fn look(flow: &PotentialFlow) {
    let memory = vec![0.0; flow.state_len()];
    let _ = flow.stepping(0.002);
    let (waves, _) = WaveField::parse(WAVES, 9.81).expect("one wave");
    let forces = [
        flow.radiation_force(&memory),
        flow.excitation_force(&waves, [3.0, -1.0], 0.4, 2.0),
    ];
    for force in forces {
        assert!(force.iter().all(|number| number.is_finite()), "{force}");
    }
}
