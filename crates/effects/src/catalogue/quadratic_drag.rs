//! Quadratic drag: `F = -D |v| v` axis by axis, at the middle of the body.

use super::{axes, coupling, whole_matrix};
use crate::{
    Card, Effect, Id, MatrixPart, Medium, Parameter, Part, Placement, Target, TargetKind,
    dual::{Scalar, constant, signed_square},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Parameters `surge`, `sway`, `heave` [N s^2/m^2], `roll`, `pitch`, `yaw` [N m s^2/rad^2]; or a whole matrix
/// ([`MatrixPart`]).
#[derive(Debug)]
pub struct QuadraticDrag;

static CARD: Card = Card {
    id: Id::QuadraticDrag,
    phrase: "quadratic drag",
    target: TargetKind::Body,
    summary: "drag in proportion to velocity squared",
    equation: "F = -D_Q |nu_r| nu_r axis by axis, at the middle of the body, in its frame; \
               D_Q = 1/2 rho C_d A for a translation",
    source: "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, \
             section 6.4 (nonlinear surge damping; diagonal quadratic damping of underwater vehicles, \
             section 8.1)",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for QuadraticDrag {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            axes::never_negative(["N s^2/m^2", "N m s^2/rad^2"], |axis| {
                (
                    scale.expected_quadratic_drag(axis),
                    scale.greatest_quadratic_drag(axis),
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

    /// Off-diagonal elements of D_Q, drag by the speed of the whole in place of the axis's, and forces along one axis with the
    /// square of the speed along another (X_vv of a ship in drift), as large as that one's drag.
    fn neglected_terms(&self, p: &[f64], nu: &[f64; 6], _nu_dot: &[f64; 6]) -> Vec<[f64; 6]> {
        let squares = nu.map(|value| value * value.abs());
        let products = coupling::symmetric(p, &squares).into_iter();
        let coupled = products.map(|product| product.map(|value| -value));
        let of_whole = (0..6).map(|axis| {
            let first = axis / 3 * 3;
            let speed = nu[first..first + 3].iter().map(|of| of * of).sum::<f64>();
            let mut wrench = [0.0; 6];
            wrench[axis] = -p[axis] * nu[axis] * (speed.sqrt() - nu[axis].abs());
            wrench
        });
        let others = (0..3).flat_map(|axis| (1..3).map(move |by| (axis, (axis + by) % 3)));
        let across = others.map(|(axis, other)| {
            let mut wrench = [0.0; 6];
            wrench[axis] = p[other] * nu[other] * nu[other];
            wrench
        });
        coupled.chain(of_whole).chain(across).collect()
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }

    fn matrix_part(&self) -> Option<&dyn MatrixPart> {
        Some(&whole_matrix::QUADRATIC_DRAG)
    }
}

impl WrenchLaw for QuadraticDrag {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let linear = flow.linear_at_middle();
        let force = [0, 1, 2].map(|axis| -p[axis] * signed_square(linear[axis]));
        let torque = [0, 1, 2].map(|axis| -p[axis + 3] * signed_square(flow.angular[axis]));
        about_origin(force, torque, constant(flow.middle()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn twice_as_fast_is_dragged_four_times_as_much_and_backwards_too() {
        let drag = |speed: f64| {
            let mut motion = fixture::still();
            motion.linear = [speed, 0.0, 0.0];
            QuadraticDrag.wrench(&[18.0, 0.0, 0.0, 0.0, 0.0, 0.0], &motion, &[])[0]
        };
        assert!((drag(0.5) + 18.0 * 0.25).abs() < 1e-12);
        assert!((drag(-1.0) + 4.0 * drag(0.5)).abs() < 1e-12);
    }
}
