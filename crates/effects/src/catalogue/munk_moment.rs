//! Munk's moment: it turns a body at an angle of attack.

use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Placement, Target, TargetKind,
    dual::Scalar,
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, force_and_torque},
};

/// Bound, in displaced masses.
const GREATEST: f64 = 100.0;

/// Parameters `pitch`, `yaw` [kg]: added mass across the body less that along it, beyond what the model's added mass
/// brings; negative where the model has too much.
#[derive(Debug)]
pub struct MunkMoment;

static CARD: Card = Card {
    id: Id::MunkMoment,
    phrase: "a Munk moment",
    target: TargetKind::Body,
    summary: "turning moment of a body at an angle of attack",
    equation: "torque = (M_A nu_r) x nu_r = ((k_yaw - k_pitch) v w, k_pitch u w, -k_yaw u v), k_pitch = m_z - m_x \
               and k_yaw = m_y - m_x beyond what an added mass in the model brings; u, v, w at the middle of the body",
    source: "M. M. Munk, The Aerodynamic Forces on Airship Hulls, NACA Report 184, 1924; J. N. Newman, Marine \
             Hydrodynamics, MIT Press 1977, section 4.14",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for MunkMoment {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let bound = GREATEST * scale.displaced();
            ["pitch", "yaw"]
                .into_iter()
                .map(|name| {
                    Parameter::about(name, "kg", 0.0, scale.displaced()).within(-bound, bound)
                })
                .collect()
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for MunkMoment {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let [u, v, w] = flow.linear_at_middle();
        let torque = [(p[1] - p[0]) * v * w, p[0] * u * w, -p[1] * u * v];
        force_and_torque([D::from(0.0); 3], torque)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::catalogue::added_mass;
    use crate::tests::fixture;

    /// A slender cylinder at an angle of attack: 1/2 rho V U^2 sin(2 alpha), for its added mass is rho V
    /// across and nothing along (Newman 1977, section 4.14).
    #[test]
    fn a_slender_cylinder_has_munks_moment() {
        let (displaced, speed, alpha) = (30.0, 1.4, 0.3_f64);
        let mut motion = fixture::still();
        motion.linear = [speed * alpha.cos(), 0.0, speed * alpha.sin()];
        let wrench = MunkMoment.wrench(&[displaced, displaced], &motion, &[]);
        let expected = 0.5 * displaced * speed * speed * (2.0 * alpha).sin();
        assert!((wrench[4] - expected).abs() < 1e-12);
    }

    #[test]
    fn in_straight_motion_it_is_what_an_added_mass_brings() {
        let mut motion = fixture::still();
        motion.linear = [0.7, -0.3, 0.4];
        let brought = added_mass::AddedMass.wrench(&[2.0, 11.0, 9.0, 0.0, 0.0, 0.0], &motion, &[]);
        let alone = MunkMoment.wrench(&[7.0, 9.0], &motion, &[]);
        for axis in 3..6 {
            assert!(brought[axis].abs() > 0.1);
            assert!((alone[axis] - brought[axis]).abs() < 1e-12, "{axis}");
        }
    }
}
