//! First-order lag of an actuator: `time_constant dy/dt = u - y`, exact over a step.

use crate::{
    ActuatorPart, Card, Effect, Id, Parameter, Part, Physical, Placement, Target, TargetKind,
};

/// Parameter `time_constant` [s]. Memory: the filtered command, zero at a cold start.
#[derive(Debug)]
pub struct ActuatorLag;

static CARD: Card = Card {
    id: Id::ActuatorLag,
    phrase: "an actuator lag",
    target: TargetKind::Actuator,
    summary: "an actuator that follows its command with a first-order lag",
    equation: "time_constant du'/dt = u - u', exact over a step: u' += (1 - exp(-h/time_constant)) (u - u')",
    source: "T. I. Fossen, Handbook of marine craft hydrodynamics and motion control, Wiley, 2011; \
             D. R. Yoerger, J. G. Cooke, J.-J. E. Slotine, IEEE Journal of Oceanic Engineering 15(3), 1990; \
             MuJoCo's `filterexact` with `actearly`",
    idealised: true,
    placement: Placement::Mjcf,
};

impl Effect for ActuatorLag {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Actuator(actuator) = target else {
            return Vec::new();
        };
        vec![
            Parameter::about("time_constant", "s", 0.0, 0.1)
                .within(0.0, 10.0)
                .physically(Physical::NotNegative)
                // exp(-h/t) is flat at zero.
                .starting((5.0 * actuator.step).max(0.01)),
        ]
    }

    fn is_timing(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Actuator(self)
    }
}

impl ActuatorPart for ActuatorLag {
    /// The filtered command; zero at a cold start, as MuJoCo's activations are.
    fn memory_len(&self, _p: &[f64], _step: f64) -> usize {
        1
    }

    fn command(&self, p: &[f64], command: f64, step: f64, memory: &mut [f64]) -> f64 {
        let Some(filtered) = memory.first_mut() else {
            return command;
        };
        *filtered = if p[0] > 0.0 {
            *filtered - (-step / p[0]).exp_m1() * (command - *filtered)
        } else {
            command
        };
        *filtered
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_step_is_answered_in_closed_form(lag in 0.005..1.0, h in 0.0005..0.02, height in -3.0..3.0) {
            let mut memory = [0.0];
            for k in 1..200 {
                let out = ActuatorLag.command(&[lag], height, h, &mut memory);
                let expected = height * (1.0 - (-f64::from(k) * h / lag).exp());
                prop_assert!((out - expected).abs() < 1e-11);
            }
        }

        #[test]
        fn two_half_steps_are_one_step(lag in 0.005..1.0, h in 0.0005..0.02, from in -3.0..3.0) {
            let (mut whole, mut halves) = ([from], [from]);
            ActuatorLag.command(&[lag], 1.0, h, &mut whole);
            ActuatorLag.command(&[lag], 1.0, h / 2.0, &mut halves);
            ActuatorLag.command(&[lag], 1.0, h / 2.0, &mut halves);
            prop_assert!((whole[0] - halves[0]).abs() < 1e-13);
        }
    }

    #[test]
    fn none_passes_everything() {
        let mut memory = [0.7];
        assert_eq!(ActuatorLag.command(&[0.0], 0.3, 0.01, &mut memory), 0.3);
        assert_eq!(ActuatorLag.command(&[1e-300], 0.2, 0.01, &mut memory), 0.2);
    }
}
