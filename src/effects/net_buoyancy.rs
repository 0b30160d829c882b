//! Buoyancy less weight, at the centre of mass.

use super::{
    Card, Effect, Id, Parameter, Part, Placement, Target, TargetKind,
    body_scale::body,
    flow::Flow,
    law::{Law, Parameters, Scalar, about_origin, constant, scaled},
};

/// A trim that is off by a few per cent of the weight.
const TYPICAL: f64 = 0.05;
/// Bound, in weights.
const GREATEST: f64 = 2.0;

/// The effect. Parameter `force` [N]: upwards where positive.
#[derive(Debug)]
pub struct NetBuoyancy;

/// The one in the catalogue.
pub static EFFECT: NetBuoyancy = NetBuoyancy;

static CARD: Card = Card {
    id: Id::NetBuoyancy,
    target: TargetKind::Body,
    summary: "buoyancy less weight, at the centre of mass",
    equation: "F = force up, against gravity (world z where there is none), at the centre of mass",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, \
             section 4.1 (hydrostatics of submerged vehicles)",
    placement: Placement::Plugin,
};

impl Effect for NetBuoyancy {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        body(target).map_or_else(Vec::new, |scale| {
            let (weight, bound) = (scale.weight(), GREATEST * scale.weight());
            vec![Parameter::about("force", "N", 0.0, TYPICAL * weight).within(-bound, bound)]
        })
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl Law for NetBuoyancy {
    const DAMPS: bool = false;

    fn law<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let (up, _) = flow.up();
        let force = scaled(p[0], constant(up));
        about_origin(force, [D::from(0.0); 3], constant(flow.centre()))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::effects::{BodyPart, fixture};

    #[test]
    fn a_body_on_its_side_is_pushed_up_all_the_same() {
        let mut motion = fixture::still();
        motion.centre = [0.2, 0.0, 0.0];
        // A quarter turn about x: the world's up is the body's y.
        motion.world_from_base =
            UnitQuaternion::from_euler_angles(0.5 * std::f64::consts::PI, 0.0, 0.0);
        let wrench = EFFECT.wrench(&[3.0], &motion, &[]);
        let expected = [0.0, 3.0, 0.0, 0.0, 0.0, 0.6];
        for (found, expected) in wrench.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12);
        }
        motion.gravity = [0.0; 3];
        assert!((EFFECT.wrench(&[3.0], &motion, &[])[1] - 3.0).abs() < 1e-12);
    }
}
