//! Viscous damping of a joint: `f = -damping v`.

use crate::{
    Card, Effect, Id, JointMotion, JointPart, Parameter, Part, Physical, Placement, Target,
    TargetKind,
};

/// Least speed at which the greatest force may act [rad/s or m/s].
const LEAST_SPEED: f64 = 0.1;

/// Parameter `damping` [N m s/rad or N s/m].
#[derive(Debug)]
pub struct JointDamping;

static CARD: Card = Card {
    id: Id::JointDamping,
    phrase: "joint damping",
    target: TargetKind::Joint,
    summary: "viscous damping of a joint",
    equation: "f = -damping v",
    source: "B. Armstrong-Helouvry et al., Automatica 30(7), 1994, section 2; MuJoCo's `joint damping`",
    idealised: true,
    placement: Placement::Mjcf,
};

impl Effect for JointDamping {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Joint(joint) = target else {
            return Vec::new();
        };
        let scale = joint.typical_force() / joint.typical_speed();
        vec![
            Parameter::about("damping", joint.damping_unit(), 0.0, 0.2 * scale)
                .within(0.0, joint.greatest_force() / LEAST_SPEED)
                .physically(Physical::NotNegative),
        ]
    }

    fn is_additive(&self) -> bool {
        true
    }

    fn is_of_every_joint(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Joint(self)
    }
}

impl JointPart for JointDamping {
    fn force(&self, p: &[f64], motion: &JointMotion, _memory: &[f64]) -> f64 {
        -p[0] * motion.velocity
    }

    fn damping(&self, p: &[f64], _motion: &JointMotion, _memory: &[f64]) -> f64 {
        p[0]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_opposes_motion_in_proportion(damping in 0.0..100.0, v in -5.0..5.0) {
            let force = JointDamping.force(&[damping], &JointMotion::new(0.0, v), &[]);
            prop_assert!(force * v <= 0.0);
            let slope = JointDamping.force(&[damping], &JointMotion::new(0.0, v + 1.0), &[]) - force;
            prop_assert!((slope + JointDamping.damping(&[damping], &JointMotion::new(0.0, v), &[])).abs() < 1e-9);
        }
    }
}
