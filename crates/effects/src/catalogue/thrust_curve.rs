//! Thrust by command: what a thruster's data sheet gives, in place of a gain.

use crate::{
    ActuatorPart, Card, Effect, Id, Parameter, Part, Physical, Placement, Target, TargetKind,
    card::LARGEST,
};

/// Parameters `forward` and `reverse` [N], `full` and `width` in the unit of the command, `exponent` [1].
///
/// The actuator's gain is 1: what it would push with is its command, after its limits and its activation.
#[derive(Debug)]
pub struct ThrustCurve;

static CARD: Card = Card {
    id: Id::ThrustCurve,
    phrase: "a thrust curve",
    target: TargetKind::Actuator,
    summary: "the command becomes a thrust: other ahead than astern, with a dead band and a power",
    equation: "T = forward s^exponent for u > 0, -reverse s^exponent for u < 0, s = max(|u| - width, 0) / (full - width)",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 9.1 (T = T_nn n \
             |n|); D. R. Yoerger, J. G. Cooke, J.-J. E. Slotine, IEEE Journal of Oceanic Engineering 15(3), 1990; makers' tables",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for ThrustCurve {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Actuator(actuator) = target else {
            return Vec::new();
        };
        let full = if actuator.command > 0.0 {
            actuator.command
        } else {
            1.0
        };
        let thrust = |name| {
            Parameter::about(name, "N", 0.0, 50.0)
                .within(0.0, f64::INFINITY)
                .physically(Physical::NotNegative)
        };
        vec![
            thrust("forward"),
            thrust("reverse"),
            Parameter::about("full", "control", full, full)
                .within(1e-3 * full, f64::INFINITY)
                .physically(Physical::Positive)
                .left_out_as(1.0),
            Parameter::about("width", "control", 0.0, 0.1 * full)
                .within(0.0, full)
                .physically(Physical::NotNegative)
                .left_out_as(0.0),
            Parameter::about("exponent", "1", 2.0, 0.5)
                .within(0.5, 4.0)
                .physically(Physical::Between(0.1, 10.0))
                .left_out_as(2.0),
        ]
    }

    fn is_hypothesis(&self) -> bool {
        false
    }

    fn part(&self) -> Part<'_> {
        Part::Actuator(self)
    }
}

impl ActuatorPart for ThrustCurve {
    fn force(&self, p: &[f64], command: f64) -> f64 {
        let [forward, reverse, full, width, exponent] = *p else {
            return command;
        };
        let span = (full - width).max(f64::MIN_POSITIVE);
        let share = ((command.abs() - width).max(0.0) / span).powf(exponent);
        let thrust = if command < 0.0 {
            -reverse * share
        } else {
            forward * share
        };
        // A command far beyond full, or no number.
        thrust.clamp(-LARGEST, LARGEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A T200 at 16 V: 51.5 N ahead, 40.2 N astern, nothing within 7.5 %.
    const T200: [f64; 5] = [51.5, 40.2, 1.0, 0.075, 2.0];

    fn thrust(p: &[f64], command: f64) -> f64 {
        ThrustCurve.force(p, command)
    }

    #[test]
    fn full_commands_give_full_thrust_and_the_dead_band_none() {
        assert_eq!(thrust(&T200, 1.0), 51.5);
        assert_eq!(thrust(&T200, -1.0), -40.2);
        for command in [0.0, 0.075, -0.05] {
            assert_eq!(thrust(&T200, command), 0.0);
        }
        let half = 0.075 + 0.5 * 0.925;
        assert!((thrust(&T200, half) - 51.5 / 4.0).abs() < 1e-12);
    }

    #[test]
    fn it_rises_with_the_command() {
        let mut last = f64::NEG_INFINITY;
        for step in -120..=120 {
            let now = thrust(&T200, f64::from(step) / 100.0);
            assert!(now >= last);
            last = now;
        }
    }

    #[test]
    fn absurd_commands_and_a_full_command_within_the_dead_band_stay_finite() {
        for command in [1e300, -1e300, f64::MAX] {
            assert!(thrust(&T200, command).is_finite());
            assert!(thrust(&[5.0, 5.0, 0.1, 0.1, 2.0], command).is_finite());
        }
    }
}
