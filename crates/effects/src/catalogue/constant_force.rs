//! Constant force at the centre of mass, and a constant torque, both fixed in the world.

use super::axes;
use crate::{
    Card, Effect, Id, Parameter, Part, Placement, Target, TargetKind,
    dual::{Scalar, constant, scaled, sum},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Prior, in weights; of the torque, at half the greatest extent.
const TYPICAL: f64 = 0.15;
/// Bound, in weights; of the torque, at the greatest extent.
const GREATEST: f64 = 10.0;

/// Parameters `x`, `y`, `z` [N] and, optional, `torque_x`, `torque_y`, `torque_z` [N m], all in the world frame.
#[derive(Debug)]
pub struct ConstantForce;

static CARD: Card = Card {
    id: Id::ConstantForce,
    phrase: "a constant force",
    target: TargetKind::Body,
    summary: "a force that never changes, and a torque where it does not pull at the centre of mass",
    equation: "F = R^T f at the centre of mass, torque = R^T m; f and m constant in the world",
    source: "I. Newton, Principia, 1687, second law; the bias of T. I. Fossen, Handbook of Marine Craft \
             Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 13.2, held constant",
    idealised: false,
    placement: Placement::Plugin,
};

impl Effect for ConstantForce {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let weight = scale.weight();
            let lever = scale.length();
            let torque = axes::optional_vector(
                "torque",
                "N m",
                [TYPICAL * weight * lever / 2.0; 3],
                [GREATEST * weight * lever; 3],
            );
            axes::vector("N", [TYPICAL * weight; 3], [GREATEST * weight; 3])
                .chain(torque)
                .collect()
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    /// Its vertical part is net buoyancy.
    fn includes(&self, other: Id, _complete: bool) -> bool {
        other == Id::NetBuoyancy
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for ConstantForce {
    const DEPENDS_ON_VELOCITY: bool = false;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        // The world's axes in the body's frame, each weighed by its component.
        let axis = |unit: [f64; 3]| constant(flow.in_body(unit));
        let in_body = |first: usize| {
            sum(
                scaled(p[first], axis([1.0, 0.0, 0.0])),
                sum(
                    scaled(p[first + 1], axis([0.0, 1.0, 0.0])),
                    scaled(p[first + 2], axis([0.0, 0.0, 1.0])),
                ),
            )
        };
        about_origin(in_body(0), in_body(3), constant(flow.centre()))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn it_keeps_its_direction_in_the_world() {
        let mut motion = fixture::still();
        motion.centre = [0.02, -0.01, 0.03];
        motion.world_from_base = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0);
        let wrench = ConstantForce.wrench(&[1.0, -2.0, 0.5, 0.3, 0.2, -0.7], &motion, &[]);
        let in_world = |first: usize| {
            motion.world_from_base
                * Vector3::new(wrench[first], wrench[first + 1], wrench[first + 2])
        };
        assert!((in_world(0) - Vector3::new(1.0, -2.0, 0.5)).norm() < 1e-12);
        // Beside its own torque, that of the force at the centre of mass about the body's origin.
        let centre = motion.world_from_base * Vector3::from(motion.centre);
        let lever = centre.cross(&Vector3::new(1.0, -2.0, 0.5));
        assert!((in_world(3) - lever - Vector3::new(0.3, 0.2, -0.7)).norm() < 1e-12);
    }
}
