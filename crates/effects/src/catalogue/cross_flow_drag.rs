//! Cross-flow drag: quadratic drag of strips along the body, so that turning is dragged too.

use super::axes;
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target, TargetKind,
    dual::{Scalar, constant, cross, real, scaled, signed_square, sum},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Normal drag coefficient of a circular cylinder, the typical one [1].
const TYPICAL: f64 = 1.0;
/// Greatest normal drag coefficient; flat strips have 2 [1].
const GREATEST: f64 = 20.0;

/// Two parameters [1]: normal drag coefficients for flow along the two axes across the longest one, named as in linear
/// drag: `sway` and `heave` for a body that is longest along x.
#[derive(Debug)]
pub struct CrossFlowDrag;

static CARD: Card = Card {
    id: Id::CrossFlowDrag,
    phrase: "cross-flow drag",
    target: TargetKind::Body,
    summary: "drag of strips along the body: turning drags too",
    equation: "F = -1/2 rho C b int |v + x r| (v + x r) dx, torque with the lever x; along the longest \
               extent, b the extent across flow and length, about the middle of the body",
    source: "S. F. Hoerner, Fluid-Dynamic Drag, 1965, chapter 3 (cross-flow principle); T. I. Fossen, \
             Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 6.4 \
             (cross-flow drag principle)",
    idealised: true,
    placement: Placement::Plugin,
};

/// The longest axis (x before y before z where they are equal) and the two others, ascending.
fn long_and_normal_axes(extent: [f64; 3]) -> (usize, [usize; 2]) {
    if extent[0] >= extent[1] && extent[0] >= extent[2] {
        (0, [1, 2])
    } else if extent[1] >= extent[2] {
        (1, [0, 2])
    } else {
        (2, [0, 1])
    }
}

impl Effect for CrossFlowDrag {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let (_, normals) = long_and_normal_axes(scale.extent);
            normals
                .into_iter()
                .map(|axis| {
                    Parameter::about(axes::NAMES[axis], "1", 0.0, TYPICAL)
                        .within(0.0, GREATEST)
                        .physically(Physical::NotNegative)
                })
                .collect()
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    /// Refines quadratic drag.
    fn is_refinement(&self) -> bool {
        true
    }

    fn medium(&self) -> Medium {
        Medium::Air
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

/// Integrals of |s| s and of x |s| s over x from -length/2 to length/2, where s = speed + x turning.
///
/// Where s keeps its sign both are polynomials. Where it changes sign inside, |turning| length/2 is
/// greater than |speed|, and the antiderivatives |s|^3/3 and s^3|s|/4 may be divided by turning.
fn strips<D: Scalar>(speed: D, turning: D, length: f64) -> (D, D) {
    let half = 0.5 * length;
    let (first, last) = (speed - turning * half, speed + turning * half);
    if real(first) * real(last) >= 0.0 {
        let squares = speed * speed * length + turning * turning * (length.powi(3) / 12.0);
        let lever = speed * turning * (length.powi(3) / 6.0);
        return if real(speed) < 0.0 {
            (-squares, -lever)
        } else {
            (squares, lever)
        };
    }
    let cubed = |s: D| signed_square(s) * s;
    let force = (cubed(last) - cubed(first)) / (turning * 3.0);
    let fourth = |s: D| cubed(s) * s;
    let moment = (fourth(last) - fourth(first)) / (turning * 4.0) - speed * force;
    (force, moment / turning)
}

impl WrenchLaw for CrossFlowDrag {
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let extent = flow.extent();
        let (long, normals) = long_and_normal_axes(extent);
        let linear = flow.linear_at_middle();
        let mut along = [D::from(0.0); 3];
        along[long] = D::from(1.0);
        let turning = cross(flow.angular, along);

        let (mut force, mut torque) = ([D::from(0.0); 3], [D::from(0.0); 3]);
        for (index, normal) in normals.into_iter().enumerate() {
            let breadth = extent[normals[1 - index]];
            let (strip_force, strip_moment) = strips(linear[normal], turning[normal], extent[long]);
            let pressure = p[index] * (-0.5 * flow.density() * breadth);
            let mut direction = [D::from(0.0); 3];
            direction[normal] = pressure;
            force = sum(force, scaled(strip_force, direction));
            torque = sum(torque, scaled(strip_moment, cross(along, direction)));
        }
        about_origin(force, torque, constant(flow.middle()))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    proptest! {
        /// Against the midpoint rule with many strips.
        #[test]
        fn the_closed_form_is_the_integral(v in -2.0..2.0, r in -3.0..3.0, length in 0.1..3.0) {
            let (force, moment): (f64, f64) = strips(v, r, length);
            let strips = 20_000;
            let (mut summed, mut lever) = (0.0, 0.0);
            for strip in 0..strips {
                let x = length * ((f64::from(strip) + 0.5) / f64::from(strips) - 0.5);
                let s: f64 = v + x * r;
                summed += s.abs() * s * length / f64::from(strips);
                lever += x * s.abs() * s * length / f64::from(strips);
            }
            let scale = (v.abs() + r.abs() * length).powi(2) * length;
            prop_assert!((force - summed).abs() < 1e-6 * scale);
            prop_assert!((moment - lever).abs() < 1e-6 * scale * length);
        }
    }

    #[test]
    fn a_cylinder_that_turns_about_its_middle_has_the_textbook_torque() {
        // Torque of a rod of length L and breadth b: 1/2 rho C b omega^2 L^4 / 32.
        let mut motion = fixture::still();
        motion.extent = [2.0, 0.2, 0.2];
        motion.angular = [0.0, 0.0, 1.5];
        let wrench = CrossFlowDrag.wrench(&[1.2, 1.2], &motion, &[]);
        let expected = -0.5 * 1000.0 * 1.2 * 0.2 * 1.5_f64.powi(2) * 16.0 / 32.0;
        assert!((wrench[5] - expected).abs() < 1e-9);
        assert!(wrench[..5].iter().all(|component| component.abs() < 1e-9));
    }

    #[test]
    fn a_broadside_flow_pushes_where_the_coefficient_says() {
        let mut motion = fixture::still();
        motion.extent = [0.1, 0.2, 0.5];
        motion.linear = [0.0, 0.4, 0.0];
        let names: Vec<_> = CrossFlowDrag
            .parameters(&Target::Body(fixture::body_scale(&motion)))
            .into_iter()
            .map(|parameter| parameter.name)
            .collect();
        assert_eq!(names, ["surge", "sway"]);
        let wrench = CrossFlowDrag.wrench(&[0.0, 1.0], &motion, &[]);
        assert!((wrench[1] + 0.5 * 1000.0 * 0.1 * 0.5 * 0.16).abs() < 1e-9);
    }
}
