//! Dead band of an actuator: commands within `width` of zero have no effect, larger ones lack `width`.
//!
//! A thruster's starting friction and a valve's overlap are dead bands.

use crate::{
    ActuatorPart, Card, Effect, Id, Parameter, Part, Physical, Placement, Target, TargetKind,
};

/// Rounding of the corners, in parts of the width. The least command that is felt is therefore not
/// infinitely sharp, and a fit has derivatives.
const ROUNDING: f64 = 0.05;

/// Parameter `width`, in the unit of the command.
#[derive(Debug)]
pub struct ActuatorDeadband;

static CARD: Card = Card {
    id: Id::ActuatorDeadband,
    phrase: "an actuator deadband",
    target: TargetKind::Actuator,
    summary: "commands within the width of zero do nothing; the width is missing from all others",
    equation: "u' = s(u - width) - s(-u - width), s(x) = T ln(1 + exp(x/T)), T = 0.05 width; for T -> 0: \
               sign(u) max(|u| - width, 0)",
    source: "G. Tao, P. V. Kokotovic, Adaptive control of plants with unknown dead-zones, IEEE Transactions \
             on Automatic Control 39(1), 1994; D. R. Yoerger, J. G. Cooke, J.-J. E. Slotine, IEEE Journal of \
             Oceanic Engineering 15(3), 1990 (thrusters); the corners are rounded",
    idealised: false,
    placement: Placement::Plugin,
};

impl Effect for ActuatorDeadband {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Actuator(actuator) = target else {
            return Vec::new();
        };
        let command = if actuator.command > 0.0 {
            actuator.command
        } else {
            1.0
        };
        vec![
            Parameter::about("width", "control", 0.0, 0.1 * command)
                .within(0.0, command)
                .physically(Physical::NotNegative)
                .starting(0.02 * command),
        ]
    }

    fn part(&self) -> Part<'_> {
        Part::Actuator(self)
    }
}

/// `T ln(1 + exp(x/T))`, without overflow.
fn soft_ramp(x: f64, rounding: f64) -> f64 {
    x.max(0.0) + rounding * (-(x / rounding).abs()).exp().ln_1p()
}

impl ActuatorPart for ActuatorDeadband {
    fn command(&self, p: &[f64], command: f64, _step: f64, _memory: &mut [f64]) -> f64 {
        let width = p[0];
        // A width too small to divide by is none at all.
        if width.is_nan() || width <= f64::MIN_POSITIVE {
            return command;
        }
        let rounding = ROUNDING * width;
        soft_ramp(command - width, rounding) - soft_ramp(-command - width, rounding)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn through(width: f64, u: f64) -> f64 {
        ActuatorDeadband.command(&[width], u, 0.01, &mut [])
    }

    proptest! {
        #[test]
        fn it_is_odd(width in 0.0..2.0, u in -5.0..5.0) {
            prop_assert!((through(width, u) + through(width, -u)).abs() < 1e-12);
        }

        #[test]
        fn it_never_turns_a_command_round_nor_makes_it_larger(width in 0.0..2.0, u in -5.0..5.0) {
            let out = through(width, u);
            prop_assert!(out * u >= 0.0 && out.abs() <= u.abs() + 1e-12);
        }

        #[test]
        fn away_from_the_corners_it_is_the_sharp_one(width in 0.01..2.0, u in -5.0..5.0) {
            let (width, u): (f64, f64) = (width, u);
            let sharp = u.signum() * (u.abs() - width).max(0.0);
            prop_assert!((through(width, u) - sharp).abs() < 0.04 * width);
            if (u.abs() - width).abs() > width {
                prop_assert!((through(width, u) - sharp).abs() < 1e-9);
            }
        }

        #[test]
        fn it_is_smooth_in_its_width(width in 0.05..2.0, u in -5.0..5.0) {
            let slope = |h: f64| (through(width + h, u) - through(width - h, u)) / (2.0 * h);
            prop_assert!((slope(1e-5) - slope(2e-5)).abs() < 1e-3);
        }
    }

    #[test]
    fn none_passes_everything() {
        assert_eq!(through(0.0, 0.3), 0.3);
    }
}
