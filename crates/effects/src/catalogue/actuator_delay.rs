//! Pure delay of an actuator: `u'(t) = u(t - delay)`.
//!
//! Past commands are kept in a ring, one a step, and interpolated linearly, so that a simulation is continuous in the
//! delay and a fit has derivatives.

use crate::{
    ActuatorPart, Card, Effect, Id, Parameter, Part, Physical, Placement, Target, TargetKind,
};

/// Longest delay that is looked for [s].
const LONGEST: f64 = 0.5;
/// Longest delay of a file [s]: its commands are kept, one a step.
const LONGEST_KEPT: f64 = 60.0;

/// Parameter `delay` [s]. Memory: the ring's next place, then the commands.
#[derive(Debug)]
pub struct ActuatorDelay;

static CARD: Card = Card {
    id: Id::ActuatorDelay,
    phrase: "an actuator delay",
    target: TargetKind::Actuator,
    summary: "an actuator whose commands arrive late",
    equation: "u'(t) = u(t - delay), linear between steps, zero before the start",
    source: "K. J. Astrom, B. Wittenmark, Computer-controlled systems, Prentice Hall, 1997, section 2.6; \
             MuJoCo 4.0's actuator `delay` with `interp=\"linear\"`",
    idealised: false,
    placement: Placement::Mjcf,
};

impl Effect for ActuatorDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Actuator(actuator) = target else {
            return Vec::new();
        };
        vec![
            Parameter::about("delay", "s", 0.0, 0.05)
                .within(0.0, LONGEST)
                .physically(Physical::Between(0.0, LONGEST_KEPT))
                .starting(2.5 * actuator.step),
        ]
    }

    fn is_timing(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Actuator(self)
    }
}

/// Commands that are kept: enough for the longest delay, whatever the present one, so that a change of
/// the delay does not change the size of a saved state. A step of 1e-300 s asks for all that can be counted.
fn kept(delay: f64, step: f64) -> usize {
    // A state is sized before its file is checked.
    let longest = LONGEST.max(delay.min(LONGEST_KEPT));
    if step > 0.0 {
        ((longest / step).ceil() as usize).saturating_add(2)
    } else {
        2
    }
}

impl ActuatorPart for ActuatorDelay {
    /// Where the next command goes, then the commands.
    fn memory_len(&self, p: &[f64], step: f64) -> usize {
        kept(p[0], step).saturating_add(1)
    }

    fn command(&self, p: &[f64], command: f64, step: f64, memory: &mut [f64]) -> f64 {
        let Some((next, ring)) = memory.split_first_mut() else {
            return command;
        };
        if ring.len() < 2 || step.is_nan() || step <= 0.0 {
            return command;
        }
        let now = (*next as usize).min(ring.len() - 1);
        ring[now] = command;
        *next = ((now + 1) % ring.len()) as f64;
        let steps = (p[0] / step).clamp(0.0, (ring.len() - 2) as f64);
        let (whole, part) = (steps.floor() as usize, steps.fract());
        let ago = |steps: usize| ring[(now + ring.len() - steps) % ring.len()];
        (1.0 - part) * ago(whole) + part * ago(whole + 1)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The whole answer to a signal.
    fn delayed(delay: f64, step: f64, signal: &[f64]) -> Vec<f64> {
        let mut memory = vec![0.0; ActuatorDelay.memory_len(&[delay], step)];
        signal
            .iter()
            .map(|u| ActuatorDelay.command(&[delay], *u, step, &mut memory))
            .collect()
    }

    proptest! {
        #[test]
        fn it_shifts_a_signal(
            signal in prop::collection::vec(-2.0..2.0, 150..200), delay in 0.0..0.6, step in 0.005..0.02,
        ) {
            let out = delayed(delay, step, &signal);
            for (k, out) in out.iter().enumerate() {
                let at = k as f64 - delay / step;
                let read = |k: f64| if k < 0.0 { 0.0 } else { signal[k as usize] };
                let expected = read(at.floor()) + (at - at.floor())
                    * (if at == at.floor() { 0.0 } else { read(at.ceil()) - read(at.floor()) });
                prop_assert!((out - expected).abs() < 1e-9, "{k}: {out} {expected}");
            }
        }

        #[test]
        fn it_is_continuous_in_the_delay(
            signal in prop::collection::vec(-2.0..2.0, 60), steps in 0usize..20,
        ) {
            let h = 0.01;
            let below = delayed((steps as f64 * h - 1e-9).max(0.0), h, &signal);
            let above = delayed(steps as f64 * h + 1e-9, h, &signal);
            for (a, b) in below.iter().zip(&above) {
                prop_assert!((a - b).abs() < 1e-5);
            }
        }

        #[test]
        fn its_derivative_is_that_of_the_signal(delay in 0.001..0.3, phase in 0.0..6.0) {
            let (delay, phase): (f64, f64) = (delay, phase);
            let (h, d) = (0.002, 1e-6);
            let signal: Vec<f64> = (0..200).map(|k| (3.0 * h * f64::from(k) + phase).sin()).collect();
            let slope = (delayed(delay + d, h, &signal)[199] - delayed(delay - d, h, &signal)[199]) / (2.0 * d);
            let expected = -3.0 * (3.0 * (h * 199.0 - delay) + phase).cos();
            prop_assert!((slope - expected).abs() < 0.03, "{slope} {expected}");
        }
    }

    #[test]
    fn none_passes_everything() {
        assert_eq!(delayed(0.0, 0.01, &[1.0, -2.0, 3.0]), [1.0, -2.0, 3.0]);
    }

    #[test]
    fn the_size_of_its_memory_does_not_depend_on_a_delay_that_is_looked_for() {
        assert_eq!(
            ActuatorDelay.memory_len(&[0.0], 0.01),
            ActuatorDelay.memory_len(&[0.5], 0.01)
        );
    }
}
