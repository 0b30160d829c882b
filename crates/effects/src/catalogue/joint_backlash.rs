//! Backlash of a joint: `q_body = q_joint + s`, `|s| <= play / 2`, free between the stops.
//!
//! Backlash is not a force: the body behind the gap moves freely and needs a coordinate of its own. The simulator puts a
//! limited joint without a sensor in series behind the named joint ([`JointPart::backlash`]), which keeps its actuator and
//! its sensor; a patched model gets the same joint. The force of the effect itself is therefore zero.

use crate::{
    Card, Effect, Id, JointMotion, JointPart, Parameter, Part, Physical, Placement, Target,
    TargetKind,
};

/// Widest gap [rad or m].
const WIDEST: f64 = 3.0;

/// Parameter `play` [rad or m]: the full width of the gap.
#[derive(Debug)]
pub struct JointBacklash;

static CARD: Card = Card {
    id: Id::JointBacklash,
    phrase: "joint backlash",
    target: TargetKind::Joint,
    summary: "play between a joint and the body that it moves",
    equation: "q_body = q_joint + s, |s| <= play/2, free between the stops",
    source: "M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash - a survey, \
             Automatica 38(10), 2002, section 2 (exact model with a free gap)",
    idealised: false,
    placement: Placement::Mjcf,
};

impl Effect for JointBacklash {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Joint(joint) = target else {
            return Vec::new();
        };
        let travel = joint.typical_travel();
        vec![
            Parameter::about("play", joint.position_unit(), 0.0, 0.1 * travel)
                .within(0.0, WIDEST)
                .physically(Physical::NotNegative)
                // At zero the limits of the extra joint meet: no derivative.
                .starting(0.005 * travel),
        ]
    }

    /// Play lies between a drive and what it moves: a joint without a drive has none that its own sensor would not show.
    fn applies_to(&self, target: &Target) -> bool {
        matches!(target, Target::Joint(joint) if joint.driven)
    }

    fn part(&self) -> Part<'_> {
        Part::Joint(self)
    }
}

impl JointPart for JointBacklash {
    fn force(&self, _p: &[f64], _motion: &JointMotion, _memory: &[f64]) -> f64 {
        0.0
    }

    fn damping(&self, _p: &[f64], _motion: &JointMotion, _memory: &[f64]) -> f64 {
        0.0
    }

    fn backlash(&self, p: &[f64]) -> Option<f64> {
        (p[0] > 0.0).then_some(p[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_backlash_asks_for_no_joint() {
        assert_eq!(JointBacklash.backlash(&[0.0]), None);
        assert_eq!(JointBacklash.backlash(&[0.02]), Some(0.02));
        assert_eq!(
            JointBacklash.force(&[0.02], &JointMotion::new(1.0, 1.0), &[]),
            0.0
        );
    }
}
