//! Rotor inertia of a joint: `f = -armature a`.

use super::payload::TYPICAL;
use crate::{
    Card, Effect, Id, JointMotion, JointPart, Parameter, Part, Physical, Placement, Target,
    TargetKind,
};

/// Bound, in inertias that the joint moves: through a gear of 100 a rotor weighs more than a light link.
const GREATEST: f64 = 100.0;
/// Part of the joint's own that a fit may take away.
const MOST: f64 = 0.95;

/// Parameter `armature` [kg m^2 or kg]: added to the joint's own; a negative one, which a fit may find, takes away.
#[derive(Debug)]
pub struct JointArmature;

static CARD: Card = Card {
    id: Id::JointArmature,
    phrase: "joint armature",
    target: TargetKind::Joint,
    summary: "inertia of the motor's rotor, through the gear, beyond the joint's own",
    equation: "f = -armature a, a the joint's acceleration",
    source: "R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, section 9.6 (gears); MuJoCo's `joint armature`",
    idealised: false,
    placement: Placement::Mjcf,
};

impl Effect for JointArmature {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Joint(joint) = target else {
            return Vec::new();
        };
        vec![
            Parameter::about(
                "armature",
                joint.inertia_unit(),
                0.0,
                TYPICAL * joint.typical_inertia(),
            )
            .within(
                0.0 - MOST * joint.armature,
                GREATEST * joint.typical_inertia(),
            )
            // Less than a model has is said in the model: instances of the plugin do not know of each other.
            .physically(Physical::NotNegative),
        ]
    }

    /// A joint without a drive has no rotor.
    fn applies_to(&self, target: &Target) -> bool {
        matches!(target, Target::Joint(joint) if joint.driven)
    }

    fn is_of_every_joint(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Joint(self)
    }
}

impl JointPart for JointArmature {
    fn force(&self, _p: &[f64], _motion: &JointMotion, _memory: &[f64]) -> f64 {
        0.0
    }

    fn damping(&self, _p: &[f64], _motion: &JointMotion, _memory: &[f64]) -> f64 {
        0.0
    }

    fn has_inertia(&self) -> bool {
        true
    }

    fn inertia(&self, p: &[f64]) -> f64 {
        p[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    /// A fit leaves some of what the joint has, so that its inertia stays positive whatever its links weigh; a file takes nothing.
    #[test]
    fn what_is_left_is_positive() {
        for armature in [0.0, 0.2] {
            let Target::Joint(mut scale) = fixture::target(TargetKind::Joint) else {
                panic!("no joint")
            };
            scale.armature = armature;
            let [parameter] = &JointArmature.parameters(&Target::Joint(scale))[..] else {
                panic!("one parameter")
            };
            assert_eq!(armature + parameter.lower > 0.0, armature > 0.0);
            assert!(
                parameter.lower <= 0.0 && parameter.lower.is_sign_positive() == (armature == 0.0)
            );
            assert!(parameter.physical.holds(0.0) && !parameter.physical.holds(-1e-6));
        }
    }
}
