//! Gain error of an actuator: its force times `gain`.

use crate::{
    ActuatorPart, Card, Effect, Id, Parameter, Part, Physical, Placement, Target, TargetKind,
};

/// Parameter `gain` [1].
#[derive(Debug)]
pub struct ActuatorGain;

static CARD: Card = Card {
    id: Id::ActuatorGain,
    phrase: "an actuator gain",
    target: TargetKind::Actuator,
    summary: "an actuator whose force is a constant factor off",
    equation: "f = gain f_nominal(u, q, v), before limits of the force",
    source: "A. Alessandri, M. Caccia, G. Veruggio, Fault detection of actuator faults in unmanned \
             underwater vehicles, Control Engineering Practice 7(3), 1999 (loss of thrust as a factor)",
    idealised: false,
    placement: Placement::Mjcf,
};

impl Effect for ActuatorGain {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Actuator(_) = target else {
            return Vec::new();
        };
        vec![
            Parameter::about("gain", "1", 1.0, 0.3)
                .within(0.0, 5.0)
                .physically(Physical::NotNegative),
        ]
    }

    fn part(&self) -> Part<'_> {
        Part::Actuator(self)
    }
}

impl ActuatorPart for ActuatorGain {
    fn force_factor(&self, p: &[f64], _inflow: f64) -> f64 {
        p[0]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_force_scales_and_the_command_passes(gain in 0.0..5.0, inflow in -3.0..3.0, u in -9.0..9.0) {
            prop_assert_eq!(ActuatorGain.force_factor(&[gain], inflow), gain);
            prop_assert_eq!(ActuatorGain.command(&[gain], u, 0.01, &mut []), u);
        }
    }
}
