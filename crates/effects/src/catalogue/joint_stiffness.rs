//! Spring of a joint: `f = -stiffness (q - reference)`.

use crate::{
    Card, Effect, Id, JointMotion, JointPart, Parameter, Part, Physical, Placement, Target,
    TargetKind,
};

/// Least excursion at which the greatest force may act, and the farthest reference [rad or m].
const LEAST_TRAVEL: f64 = 0.01;
const FARTHEST: f64 = 100.0;

/// Parameters `stiffness` [N m/rad or N/m], `reference` [rad or m].
#[derive(Debug)]
pub struct JointStiffness;

static CARD: Card = Card {
    id: Id::JointStiffness,
    phrase: "joint stiffness",
    target: TargetKind::Joint,
    summary: "a spring of a joint: a tether, a hose, a seal",
    equation: "f = -stiffness (q - reference)",
    source: "Hooke's law; MuJoCo's `joint stiffness springref`",
    idealised: true,
    placement: Placement::Mjcf,
};

impl Effect for JointStiffness {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Joint(joint) = target else {
            return Vec::new();
        };
        let travel = joint.typical_travel();
        let scale = joint.typical_force() / travel;
        let middle = joint.middle.clamp(-FARTHEST, FARTHEST);
        vec![
            Parameter::about("stiffness", joint.stiffness_unit(), 0.0, 0.2 * scale)
                .within(0.0, joint.greatest_force() / LEAST_TRAVEL)
                .physically(Physical::NotNegative),
            // Without influence where there is no spring. It may be at rest anywhere from the joint's zero to where it moves.
            Parameter::about(
                "reference",
                joint.position_unit(),
                middle,
                travel.hypot(middle),
            )
            .within(-FARTHEST, FARTHEST)
            .shaping(),
        ]
    }

    /// About which position the spring is at rest decides which way it pushes.
    fn has_places(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Joint(self)
    }
}

impl JointPart for JointStiffness {
    fn force(&self, p: &[f64], motion: &JointMotion, _memory: &[f64]) -> f64 {
        -p[0] * (motion.position - p[1])
    }

    fn damping(&self, _p: &[f64], _motion: &JointMotion, _memory: &[f64]) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn its_force_is_the_slope_of_its_energy(
            stiffness in 0.0..100.0, reference in -1.0..1.0, q in -2.0..2.0,
        ) {
            let energy = |q: f64| { let away: f64 = q - reference; 0.5 * stiffness * away * away };
            let h = 1e-5;
            let slope = (energy(q + h) - energy(q - h)) / (2.0 * h);
            let force = JointStiffness.force(&[stiffness, reference], &JointMotion::new(q, 1.0), &[]);
            prop_assert!((force + slope).abs() < 1e-6 * (1.0 + slope.abs()));
        }
    }
}
