//! Linear drag: `F = -D v`, diagonal, at the middle of the body.

use super::{axes, coupling, whole_matrix};
use crate::{
    Card, Effect, Id, MatrixPart, Medium, Parameter, Part, Placement, Target, TargetKind,
    dual::{Scalar, constant},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Parameters `surge`, `sway`, `heave` [N s/m], `roll`, `pitch`, `yaw` [N m s/rad]; or a whole matrix ([`MatrixPart`]).
#[derive(Debug)]
pub struct LinearDrag;

static CARD: Card = Card {
    id: Id::LinearDrag,
    phrase: "linear drag",
    target: TargetKind::Body,
    summary: "drag in proportion to velocity",
    equation: "F = -D_L nu_r, diagonal, at the middle of the body, in its frame",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, \
             section 6.4 (linear damping)",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for LinearDrag {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            axes::never_negative(["N s/m", "N m s/rad"], |axis| {
                (
                    scale.expected_linear_drag(axis),
                    scale.greatest_linear_drag(axis),
                )
            })
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    fn is_of_every_fluid(&self) -> bool {
        true
    }

    fn on_one_joint(&self) -> Option<Id> {
        Some(Id::JointDamping)
    }

    /// Off-diagonal elements of D.
    fn neglected_terms(&self, p: &[f64], nu: &[f64; 6], _nu_dot: &[f64; 6]) -> Vec<[f64; 6]> {
        let products = coupling::symmetric(p, nu).into_iter();
        products
            .map(|product| product.map(|value| -value))
            .collect()
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }

    fn matrix_part(&self) -> Option<&dyn MatrixPart> {
        Some(&whole_matrix::LINEAR_DRAG)
    }
}

impl WrenchLaw for LinearDrag {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let linear = flow.linear_at_middle();
        let force = [0, 1, 2].map(|axis| -p[axis] * linear[axis]);
        let torque = [0, 1, 2].map(|axis| -p[axis + 3] * flow.angular[axis]);
        about_origin(force, torque, constant(flow.middle()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    /// A link that swings about its frame's origin is dragged at its middle.
    #[test]
    fn a_link_is_dragged_at_its_middle() {
        let mut motion = fixture::still();
        motion.middle = [0.2, 0.0, 0.0];
        motion.angular = [0.0, 0.0, 1.5];
        let wrench = LinearDrag.wrench(&[0.0, 10.0, 0.0, 0.0, 0.0, 0.3], &motion, &[]);
        assert!((wrench[1] + 10.0 * 0.2 * 1.5).abs() < 1e-12);
        assert!((wrench[5] + (10.0 * 0.04 + 0.3) * 1.5).abs() < 1e-12);
    }
}
