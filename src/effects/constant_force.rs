//! A force that never changes.

use super::{
    Card, Effect, Id, Parameter, Part, Placement, Target, TargetKind, axes,
    body_scale::body,
    flow::Flow,
    law::{Law, Parameters, Scalar, about_origin, constant, scaled, sum},
};

/// Prior, in weights.
const TYPICAL: f64 = 0.05;
/// Bound, in weights.
const GREATEST: f64 = 10.0;

/// The effect. Parameters `x`, `y`, `z` [N], in the world, at the centre of mass.
#[derive(Debug)]
pub struct ConstantForce;

/// The one in the catalogue.
pub static EFFECT: ConstantForce = ConstantForce;

static CARD: Card = Card {
    id: Id::ConstantForce,
    target: TargetKind::Body,
    summary: "a force that never changes: a tether, a tilt of gravity",
    equation: "F = R^T f at the centre of mass, f constant in the world",
    source: "I. Newton, Principia, 1687, second law; the bias of T. I. Fossen, Handbook of Marine Craft \
             Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 13.2, held constant",
    placement: Placement::Plugin,
};

impl Effect for ConstantForce {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        body(target).map_or_else(Vec::new, |scale| {
            let weight = scale.weight();
            axes::vector("N", [TYPICAL * weight; 3], [GREATEST * weight; 3]).collect()
        })
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl Law for ConstantForce {
    const DAMPS: bool = false;

    fn law<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        // The world's axes in the body's frame, each weighed by its component.
        let axis = |unit: [f64; 3]| constant(flow.in_body(unit));
        let force = sum(
            scaled(p[0], axis([1.0, 0.0, 0.0])),
            sum(
                scaled(p[1], axis([0.0, 1.0, 0.0])),
                scaled(p[2], axis([0.0, 0.0, 1.0])),
            ),
        );
        about_origin(force, [D::from(0.0); 3], constant(flow.centre()))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::effects::{BodyPart, fixture};

    #[test]
    fn it_keeps_its_direction_in_the_world() {
        let mut motion = fixture::still();
        motion.world_from_base = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0);
        let wrench = EFFECT.wrench(&[1.0, -2.0, 0.5], &motion, &[]);
        let force = nalgebra::Vector3::new(wrench[0], wrench[1], wrench[2]);
        let found = motion.world_from_base * force;
        assert!((found - nalgebra::Vector3::new(1.0, -2.0, 0.5)).norm() < 1e-12);
    }
}
