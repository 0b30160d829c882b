//! An open-water propeller: thrust and torque from shaft speed and speed of advance.

use std::f64::consts::TAU;

use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target, TargetKind,
    dual::{Scalar, real},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw},
};

/// Typical coefficients of thrust and torque at rest, and their slopes by the advance ratio [1]: Wageningen B4-55, pitch ratio 0.8.
const TYPICAL: [f64; 4] = [0.35, 0.4, 0.045, 0.04];
/// Greatest of them in a fit [1].
const GREATEST: f64 = 5.0;

/// Parameters `diameter` [m], `thrust`, `thrust_slope`, `torque`, `torque_slope`, `astern`, `wake` [1].
///
/// The target is the propeller's own body, on a hinge along its x, the shaft: its spin is the shaft speed n, and motor, rotor
/// inertia and reaction on the hull are MuJoCo's. `thrust` below zero is a left-handed propeller, which pushes along +x while it
/// turns against x.
#[derive(Debug)]
pub struct Propeller;

static CARD: Card = Card {
    id: Id::Propeller,
    phrase: "a propeller",
    target: TargetKind::Body,
    summary: "thrust and torque of a propeller on its shaft, by shaft speed and speed of advance",
    equation: "T = rho D^4 thrust n |n| e - rho D^3 thrust_slope |n| u_a, Q = -rho D^5 torque n |n| + rho D^4 torque_slope |n| u_a \
               sign(thrust), along the body's x; n its spin [1/s], u_a = (1 - wake) u, e = astern where the thrust points astern, else \
               1; first quadrant: K_T = thrust - thrust_slope J, K_Q = torque - torque_slope J, J = u_a / (n D)",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 9.1 (bilinear \
             thruster model); M. M. Bernitsas, D. Ray, P. Kinley, KT, KQ and efficiency curves for the Wageningen B-series, Univ. of \
             Michigan Report 237, 1981",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for Propeller {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let across = scale.extent[1].max(scale.extent[2]);
            let diameter = if across > 0.0 { across } else { 0.1 };
            let [thrust, thrust_slope, torque, torque_slope] = TYPICAL;
            let not_negative = |name, unit, sd: f64, upper: f64| {
                Parameter::about(name, unit, 0.0, sd)
                    .within(0.0, upper)
                    .physically(Physical::NotNegative)
            };
            vec![
                not_negative("diameter", "m", diameter, 10.0 * diameter),
                Parameter::about("thrust", "1", 0.0, thrust).within(-GREATEST, GREATEST),
                not_negative("thrust_slope", "1", thrust_slope, GREATEST).left_out_as(0.0),
                not_negative("torque", "1", torque, GREATEST).left_out_as(0.0),
                not_negative("torque_slope", "1", torque_slope, GREATEST).left_out_as(0.0),
                not_negative("astern", "1", 1.0, GREATEST).left_out_as(1.0),
                Parameter::about("wake", "1", 0.0, 0.2)
                    .within(0.0, 1.0)
                    .physically(Physical::Between(0.0, 1.0))
                    .left_out_as(0.0),
            ]
        })
    }

    fn is_hypothesis(&self) -> bool {
        false
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for Propeller {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let zero = D::from(0.0);
        let [
            diameter,
            thrust,
            thrust_slope,
            torque,
            torque_slope,
            astern,
            wake,
            _,
        ] = *p;
        let spin = flow.angular[0] / TAU;
        let speed = if real(spin) < 0.0 { -spin } else { spin };
        let advance = (D::from(1.0) - wake) * flow.linear[0];
        let d3 = diameter * diameter * diameter * flow.density();
        let (d4, d5) = (d3 * diameter, d3 * diameter * diameter);
        let at_rest = d4 * thrust * spin * speed;
        let at_rest = if real(at_rest) < 0.0 {
            at_rest * astern
        } else {
            at_rest
        };
        let helped = d4 * torque_slope * speed * advance;
        let helped = if real(thrust) < 0.0 { -helped } else { helped };
        let force = at_rest - d3 * thrust_slope * speed * advance;
        let moment = helped - d5 * torque * spin * speed;
        [force, zero, zero, moment, zero, zero]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;
    use crate::{BodyPart, Motion};

    const PROPELLER: [f64; 7] = [0.25, 0.36, 0.41, 0.045, 0.038, 0.8, 0.1];

    fn spinning(per_second: f64, speed: f64) -> Motion {
        let mut motion = fixture::still();
        motion.angular[0] = TAU * per_second;
        motion.linear[0] = speed;
        motion
    }

    #[test]
    fn ahead_it_is_the_open_water_diagram() {
        for (n, speed) in [(12.0, 0.0), (12.0, 1.0), (20.0, 2.5)] {
            let wrench = Propeller.wrench(&PROPELLER, &spinning(n, speed), &[]);
            let j = 0.9 * speed / (n * 0.25);
            let thrust = 1000.0 * n * n * 0.25_f64.powi(4) * (0.36 - 0.41 * j);
            let torque = 1000.0 * n * n * 0.25_f64.powi(5) * (0.045 - 0.038 * j);
            assert!((wrench[0] - thrust).abs() < 1e-9 * thrust);
            assert!((wrench[3] + torque).abs() < 1e-9 * torque);
        }
    }

    #[test]
    fn astern_it_pushes_less_and_a_stopped_one_does_nothing() {
        let ahead = Propeller.wrench(&PROPELLER, &spinning(12.0, 0.0), &[]);
        let astern = Propeller.wrench(&PROPELLER, &spinning(-12.0, 0.0), &[]);
        assert!((astern[0] + 0.8 * ahead[0]).abs() < 1e-12);
        assert!((astern[3] + ahead[3]).abs() < 1e-12);
        assert_eq!(
            Propeller.wrench(&PROPELLER, &spinning(0.0, 1.0), &[]),
            [0.0; 6]
        );
    }

    #[test]
    fn a_left_handed_one_is_the_mirror_image() {
        let mut left = PROPELLER;
        left[1] = -left[1];
        for speed in [-1.0, 0.0, 1.5] {
            let one = Propeller.wrench(&PROPELLER, &spinning(9.0, speed), &[]);
            let other = Propeller.wrench(&left, &spinning(-9.0, speed), &[]);
            assert!((one[0] - other[0]).abs() < 1e-12 && (one[3] + other[3]).abs() < 1e-12);
        }
    }

    /// Without a motor it can only take: the shaft and the way through the water lose what the water gains.
    #[test]
    fn at_a_locked_speed_it_never_gives_more_than_the_shaft_puts_in() {
        for (n, speed) in [
            (12.0, 0.5),
            (12.0, 1.5),
            (12.0, 2.2),
            (-12.0, 1.0),
            (6.0, -1.0),
        ] {
            let motion = spinning(n, speed);
            let wrench = Propeller.wrench(&PROPELLER, &motion, &[]);
            let power = wrench[0] * speed + wrench[3] * motion.angular[0];
            assert!(power < 0.0, "{n} {speed}: {power}");
        }
    }
}
