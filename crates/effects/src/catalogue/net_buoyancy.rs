//! Net buoyancy: buoyancy less weight, a vertical force at the centre of mass or away from it.

use super::{axes, buoyancy_offset};
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Placement, Target, TargetKind,
    dual::{Scalar, constant, cross, scaled},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// A volume that is off by some per cent, of a body that weighs little in water: in weights. Where the model has no buoyancy at
/// all, that of the displaced volume is expected.
const TYPICAL: f64 = 0.15;
/// Bound, in weights.
const GREATEST: f64 = 2.0;

/// Parameters `force` [N], positive upwards, and, optional, `moment_x`, `moment_y`, `moment_z` [N m]: the force times its
/// point of action, from the centre of mass, in the body's frame.
#[derive(Debug)]
pub struct NetBuoyancy;

static CARD: Card = Card {
    id: Id::NetBuoyancy,
    phrase: "net buoyancy",
    target: TargetKind::Body,
    summary: "buoyancy less weight, at the centre of mass or away from it",
    equation: "F = force up, against gravity (world z where there is none), at the centre of mass; torque = moment x up",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, \
             section 4.1 (hydrostatics of submerged vehicles)",
    idealised: false,
    placement: Placement::Plugin,
};

impl Effect for NetBuoyancy {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let (weight, bound) = (scale.weight(), GREATEST * scale.weight());
            let length = scale.length();
            let expected = scale.buoyancy_left_out.max(TYPICAL * weight);
            let moment = axes::optional_vector(
                "moment",
                "N m",
                [buoyancy_offset::TYPICAL * weight * length; 3],
                [bound * length; 3],
            );
            std::iter::once(
                Parameter::about("force", "N", 0.0, expected.min(bound)).within(-bound, bound),
            )
            .chain(moment)
            .collect()
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    /// Weight that acts away from the centre of mass has an offset of buoyancy.
    fn includes(&self, other: Id, complete: bool) -> bool {
        complete && other == Id::BuoyancyOffset
    }

    fn is_of_every_fluid(&self) -> bool {
        true
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for NetBuoyancy {
    const DEPENDS_ON_VELOCITY: bool = false;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let (up, _) = flow.up();
        let force = scaled(p[0], constant(up));
        let torque = cross([p[1], p[2], p[3]], constant(up));
        about_origin(force, torque, constant(flow.centre()))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn a_body_on_its_side_is_pushed_up_all_the_same() {
        let mut motion = fixture::still();
        motion.centre = [0.2, 0.0, 0.0];
        // A quarter turn about x: the world's up is the body's y.
        motion.world_from_base =
            UnitQuaternion::from_euler_angles(0.5 * std::f64::consts::PI, 0.0, 0.0);
        let wrench = NetBuoyancy.wrench(&[3.0, 0.0, 0.0, 0.0], &motion, &[]);
        let expected = [0.0, 3.0, 0.0, 0.0, 0.0, 0.6];
        for (found, expected) in wrench.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12);
        }
        motion.gravity = [0.0; 3];
        assert!((NetBuoyancy.wrench(&[3.0], &motion, &[])[1] - 3.0).abs() < 1e-12);
    }

    /// A vehicle that its model holds up weighs little in water; one that it lets fall has all its buoyancy to gain.
    #[test]
    fn buoyancy_that_the_model_leaves_out_is_expected() {
        let mut scale = fixture::body_scale(&fixture::still());
        let typical = |scale: &crate::card::BodyScale| {
            NetBuoyancy.parameters(&Target::Body(scale.clone()))[0].prior_sd
        };
        let weight = scale.weight();
        assert_eq!(typical(&scale), TYPICAL * weight);
        scale.buoyancy_left_out = 0.6 * weight;
        assert_eq!(typical(&scale), 0.6 * weight);
        scale.buoyancy_left_out = 20.0 * weight;
        assert_eq!(typical(&scale), GREATEST * weight);
    }

    #[test]
    fn away_from_the_centre_of_mass_it_is_the_same_force_elsewhere() {
        let mut motion = fixture::still();
        motion.centre = [0.02, 0.01, -0.03];
        motion.world_from_base = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0);
        let (force, lever) = (3.0, [0.1, -0.05, 0.2]);
        let moved = NetBuoyancy.wrench(
            &[force, force * lever[0], force * lever[1], force * lever[2]],
            &motion,
            &[],
        );
        for (centre, lever) in motion.centre.iter_mut().zip(lever) {
            *centre += lever;
        }
        let there = NetBuoyancy.wrench(&[force, 0.0, 0.0, 0.0], &motion, &[]);
        for (moved, there) in moved.iter().zip(there) {
            assert!((moved - there).abs() < 1e-12, "{moved} {there}");
        }
    }
}
