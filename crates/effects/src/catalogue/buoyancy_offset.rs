//! Offset of the centre of buoyancy: a righting moment `r x (rho V g up)`, without a force.

use super::axes;
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Placement, Target, TargetKind,
    dual::{Scalar, constant, cross, scaled},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, force_and_torque},
};

/// Prior, in extents.
pub(super) const TYPICAL: f64 = 0.03;

/// Parameters `x`, `y`, `z` [m]: the true centre of buoyancy minus the model's, in the body's frame.
#[derive(Debug)]
pub struct BuoyancyOffset;

static CARD: Card = Card {
    id: Id::BuoyancyOffset,
    phrase: "a buoyancy offset",
    target: TargetKind::Body,
    summary: "buoyancy that acts away from where the model has it: a righting moment",
    equation: "torque = r x (rho V g up), no force; standard gravity along the world's z where the scene has none",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, \
             section 4.1 (restoring moments of submerged vehicles)",
    idealised: false,
    placement: Placement::Plugin,
};

impl Effect for BuoyancyOffset {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let length = scale.length();
            axes::vector("m", [TYPICAL * length; 3], [length; 3]).collect()
        })
    }

    fn is_additive(&self) -> bool {
        true
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

impl WrenchLaw for BuoyancyOffset {
    const DEPENDS_ON_VELOCITY: bool = false;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let (up, gravity) = flow.up();
        let buoyancy = D::from(flow.density() * flow.volume() * gravity);
        let torque = cross([p[0], p[1], p[2]], scaled(buoyancy, constant(up)));
        force_and_torque([D::from(0.0); 3], torque)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn a_body_buoyant_at_its_top_is_righted() {
        let mut motion = fixture::still();
        let roll = 0.4_f64;
        motion.world_from_base = UnitQuaternion::from_euler_angles(roll, 0.0, 0.0);
        let wrench = BuoyancyOffset.wrench(&[0.0, 0.0, 0.02], &motion, &[]);
        let buoyancy = motion.density * motion.volume * 9.81;
        assert!((wrench[3] + 0.02 * buoyancy * roll.sin()).abs() < 1e-9);
        assert_eq!(wrench[..3], [0.0; 3]);
    }
}
