//! Wake memory: drag that lags behind the motion, `F = -A z`, `z' = rate (v - z)`.

use super::axes;
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target, TargetKind,
    dual::{Scalar, constant},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Slowest and fastest wakes [1/s].
const RATES: [f64; 2] = [0.05, 50.0];

/// Parameters `surge`, `sway`, `heave` [N s/m], `roll`, `pitch`, `yaw` [N m s/rad], and `rate`
/// [1/s]. Memory: six filtered velocities [m/s, rad/s], zero for water at rest.
///
/// In steady motion it is a linear drag of these amplitudes; above the rate it fades with frequency. The transfer function
/// of the kernel A rate exp(-rate t) has a positive real part: it takes out more energy than it gives back.
#[derive(Debug)]
pub struct WakeMemory;

static CARD: Card = Card {
    id: Id::WakeMemory,
    phrase: "wake memory",
    target: TargetKind::Body,
    summary: "drag that lags behind the motion",
    equation: "F = -A z, z' = rate (nu_r - z), diagonal, at the middle of the body, in its frame",
    source: "W. E. Cummins, The Impulse Response Function and Ship Motions, Schiffstechnik 9, 1962; T. I. \
             Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section \
             5.4 (fluid memory in state-space form)",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for WakeMemory {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let mut parameters = axes::never_negative(["N s/m", "N m s/rad"], |axis| {
                (scale.linear_drag(axis), scale.greatest_linear_drag(axis))
            });
            // A wake lasts as long as the body takes to move by its own length.
            let [slowest, fastest] = RATES;
            let rate = (scale.typical_speed() / scale.length()).clamp(4.0 * slowest, 0.1 * fastest);
            parameters.push(
                Parameter::about("rate", "1/s", rate, 2.0 * rate)
                    .within(slowest, fastest)
                    .physically(Physical::Positive)
                    .shaping(),
            );
            parameters
        })
    }

    fn presupposes(&self) -> &'static [Id] {
        Id::DRAGS
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for WakeMemory {
    const MEMORY_LEN: usize = 6;
    const DEPENDS_ON_VELOCITY: bool = false;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, memory: &[f64]) -> [D; 6] {
        let force = [0, 1, 2].map(|axis| -p[axis] * memory[axis]);
        let torque = [3, 4, 5].map(|axis| -p[axis] * memory[axis]);
        about_origin(force, torque, constant(flow.middle()))
    }

    /// Exact for a velocity that is constant over the step, whatever the rate.
    fn advance_memory(&self, p: &Parameters<f64>, flow: &Flow<f64>, step: f64, memory: &mut [f64]) {
        let arrived = -(-p[6].max(0.0) * step.max(0.0)).exp_m1();
        let now = flow.linear_at_middle().into_iter().chain(flow.angular);
        for (filtered, now) in memory.iter_mut().zip(now) {
            *filtered += arrived * (now - *filtered);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    const P: [f64; 7] = [20.0, 30.0, 30.0, 1.0, 2.0, 3.0, 2.5];

    #[test]
    fn after_a_sudden_start_it_grows_to_a_linear_drag() {
        let mut motion = fixture::still();
        motion.linear = [0.5, 0.0, 0.0];
        let mut memory = [0.0; 6];
        let step = 0.01;
        for _ in 0..40 {
            WakeMemory.advance(&P, &motion, step, &mut memory);
        }
        let expected = -20.0 * 0.5 * (1.0 - (-2.5_f64 * 0.4).exp());
        assert!((WakeMemory.wrench(&P, &motion, &memory)[0] - expected).abs() < 1e-12);
        WakeMemory.advance(&P, &motion, 1e6, &mut memory);
        assert!((WakeMemory.wrench(&P, &motion, &memory)[0] + 10.0).abs() < 1e-9);
    }

    #[test]
    fn an_oscillation_is_damped_by_the_real_part_of_the_transfer_function() {
        // F = -A rate / (s + rate) v: mean power -1/2 A v^2 rate^2 / (omega^2 + rate^2).
        let (omega, step) = (4.0_f64, 1e-4);
        let mut motion = fixture::still();
        let mut memory = [0.0; 6];
        let period = (std::f64::consts::TAU / omega / step).round() as usize;
        let mut work = 0.0;
        for index in 0..11 * period {
            let speed = (omega * index as f64 * step).cos();
            motion.linear = [speed, 0.0, 0.0];
            if index >= 10 * period {
                work += WakeMemory.wrench(&P, &motion, &memory)[0] * speed / period as f64;
            }
            WakeMemory.advance(&P, &motion, step, &mut memory);
        }
        let expected = -0.5 * 20.0 * 2.5 * 2.5 / (omega * omega + 2.5 * 2.5);
        assert!((work - expected).abs() < 1e-3 * expected.abs());
    }
}
