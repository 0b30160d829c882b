//! Dry friction of a joint: Coulomb friction and Stribeck's excess at low speed,
//! `f = -(coulomb + stribeck exp(-(v / stribeck_speed)^2)) tanh(v / v0)`, `v0 = 0.1 stribeck_speed`.
//!
//! Within one time step friction stops a joint slower than `v1 = (coulomb + stribeck) dt / inertia`. A sign narrower than that
//! would turn the joint round at every step, so its width is `sqrt(v0^2 + v1^2)`.

use crate::{
    Card, Effect, Id, JointMotion, JointPart, Parameter, Part, Physical, Placement, Target,
    TargetKind,
};

/// Width of the smooth sign, in parts of the Stribeck speed: narrow enough that the excess is reached
/// before it decays.
const WIDTH: f64 = 0.1;

/// Narrowest smooth sign [rad/s or m/s], so that the force stays differentiable.
const NARROWEST: f64 = 1e-6;

/// Slowest and fastest decay of the excess [rad/s or m/s].
const SLOWEST: f64 = 1e-3;
const FASTEST: f64 = 100.0;

/// Parameters `coulomb`, `stribeck` [N m or N], `stribeck_speed` [rad/s or m/s].
#[derive(Debug)]
pub struct JointFriction;

static CARD: Card = Card {
    id: Id::JointFriction,
    phrase: "joint friction",
    target: TargetKind::Joint,
    summary: "dry friction of a joint, higher where it hardly moves",
    equation: "f = -(coulomb + stribeck exp(-(v/stribeck_speed)^2)) tanh(v/v0), \
               v0^2 = (0.1 stribeck_speed)^2 + ((coulomb + stribeck) dt / inertia)^2",
    source: "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and \
             compensation methods for the control of machines with friction, Automatica 30(7), 1994; \
             H. Olsson et al., Friction models and friction compensation, European Journal of Control 4(3), \
             1998 (the sign is made smooth)",
    idealised: true,
    placement: Placement::Mjcf,
};

impl Effect for JointFriction {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Joint(joint) = target else {
            return Vec::new();
        };
        let (force, speed) = (joint.typical_force(), joint.typical_speed());
        vec![
            Parameter::about("coulomb", joint.force_unit(), 0.0, 0.2 * force)
                .within(0.0, joint.greatest_force())
                .physically(Physical::NotNegative),
            Parameter::about("stribeck", joint.force_unit(), 0.0, 0.1 * force)
                .within(0.0, joint.greatest_force())
                .physically(Physical::NotNegative),
            // Without influence where there is no excess: the null is the centre of the prior.
            Parameter::about(
                "stribeck_speed",
                joint.speed_unit(),
                (0.1 * speed).clamp(SLOWEST, FASTEST),
                0.1 * speed,
            )
            .within(SLOWEST, FASTEST)
            .physically(Physical::Positive)
            .shaping(),
        ]
    }

    fn is_of_every_joint(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Joint(self)
    }
}

/// The parameters, and the width of the smooth sign.
struct StribeckCurve {
    coulomb: f64,
    stribeck: f64,
    speed: f64,
    width: f64,
}

impl StribeckCurve {
    fn new(p: &[f64], motion: &JointMotion) -> Self {
        let speed = p[2].abs().max(NARROWEST / WIDTH);
        let stopped = (p[0] + p[1]) * motion.velocity_per_force;
        Self {
            coulomb: p[0],
            stribeck: p[1],
            speed,
            width: (WIDTH * speed).hypot(stopped),
        }
    }
}

impl JointPart for JointFriction {
    fn force(&self, p: &[f64], motion: &JointMotion, _memory: &[f64]) -> f64 {
        let (curve, velocity) = (StribeckCurve::new(p, motion), motion.velocity);
        let decay = (-(velocity / curve.speed).powi(2)).exp();
        -(curve.coulomb + curve.stribeck * decay) * (velocity / curve.width).tanh()
    }

    /// Negative where Stribeck's excess falls faster than the smooth sign rises.
    fn damping(&self, p: &[f64], motion: &JointMotion, _memory: &[f64]) -> f64 {
        let (curve, velocity) = (StribeckCurve::new(p, motion), motion.velocity);
        let decay = (-(velocity / curve.speed).powi(2)).exp();
        let sign = (velocity / curve.width).tanh();
        (curve.coulomb + curve.stribeck * decay) * (1.0 - sign * sign) / curve.width
            - curve.stribeck * decay * sign * 2.0 * velocity / curve.speed.powi(2)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_never_drives(coulomb in 0.0..10.0, excess in 0.0..10.0, speed in 0.0..1.0, v in -5.0..5.0) {
            let force = JointFriction.force(&[coulomb, excess, speed], &JointMotion::new(0.3, v), &[]);
            prop_assert!(force * v <= 0.0);
            prop_assert!(force.abs() <= coulomb + excess);
        }

        /// A step of an integrator that takes the slope into the inertia: the rest of the motion is of the other forces.
        #[test]
        fn a_step_never_turns_the_joint_round(
            coulomb in 0.0..50.0, excess in 0.0..10.0, speed in 1e-3..1.0, v in -2.0..2.0, velocity_per_force in 0.0..0.1,
        ) {
            let p = [coulomb, excess, speed];
            let motion = JointMotion { velocity_per_force, ..JointMotion::new(0.0, v) };
            let damping = JointFriction.damping(&p, &motion, &[]).max(0.0);
            let force = JointFriction.force(&p, &motion, &[]);
            let after = v + velocity_per_force * force / (1.0 + velocity_per_force * damping);
            prop_assert!(after * v >= 0.0, "{v} {after}");
        }

        #[test]
        fn its_damping_is_its_slope(
            coulomb in 0.0..10.0, excess in 0.0..10.0, speed in 0.05..1.0, v in -2.0..2.0,
        ) {
            let p = [coulomb, excess, speed];
            let h = 1e-7;
            let slope = (JointFriction.force(&p, &JointMotion::new(0.0, v - h), &[]) - JointFriction.force(&p, &JointMotion::new(0.0, v + h), &[])) / (2.0 * h);
            let damping = JointFriction.damping(&p, &JointMotion::new(0.0, v), &[]);
            prop_assert!((slope - damping).abs() < 1e-4 * (1.0 + damping.abs()), "{slope} {damping}");
        }
    }

    #[test]
    fn well_above_the_stribeck_speed_coulomb_is_left() {
        let force = JointFriction.force(&[2.0, 1.0, 0.05], &JointMotion::new(0.0, 1.0), &[]);
        assert!((force + 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_excess_is_felt_at_low_speed() {
        let force = JointFriction.force(&[2.0, 1.0, 0.5], &JointMotion::new(0.0, 0.15), &[]);
        assert!((-2.95..-2.85).contains(&force), "{force}");
    }
}
