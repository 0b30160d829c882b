//! Backlash in a joint, as the simulator and a patched model both have it.

/// Inertia of the extra joint, in parts of what the joint moves, where the rotor before it has an inertia of its own.
const TINY: f64 = 1e-4;
/// The same where it has none: a rotor without inertia has no motion of its own.
const ROTOR: f64 = 0.05;

/// Inertia of the extra joint behind a joint with backlash [kg m^2 or kg]: it resists motion against the joint alone.
///
/// `inertia` [kg m^2 or kg] is what the joint moves, `rotor` [kg m^2 or kg] its armature, `damping` [N m s/rad or N s/m] its
/// own and its servo's. Within the gap the servo moves the rotor alone: steps of `step` [s] follow that where the damping does
/// not stop it within one. An extra joint heavier than what it moves would hold it.
pub fn armature(inertia: f64, rotor: f64, damping: f64, step: f64) -> f64 {
    let part = if rotor > 0.0 { TINY } else { ROTOR };
    (part * inertia).max((damping * step - rotor).min(inertia))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_servo_does_not_stop_the_rotor_within_a_step() {
        assert_eq!(armature(0.2, 0.0, 0.0, 0.002), 0.05 * 0.2);
        assert_eq!(armature(0.2, 0.1, 1.0, 0.002), 1e-4 * 0.2);
        for rotor in [0.0, 0.01] {
            let whole = rotor + armature(0.2, rotor, 25.0, 0.002);
            assert!(25.0 * 0.002 / whole <= 1.0 + 1e-12);
        }
        assert_eq!(armature(0.02, 0.0, 25.0, 0.002), 0.02);
    }
}
