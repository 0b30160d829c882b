//! Payload: a point mass with its weight, which displaces no water.

use nalgebra::Matrix6;

use super::{added_mass::inertia_at, axes};
use crate::{
    Card, Effect, Id, Parameter, Part, Physical, Placement, Target, TargetKind,
    dual::{Scalar, constant, cross, scaled, sum},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Prior, in masses of the body; in inertias of a joint for a rotor, which on a cart is the same thing.
pub(super) const TYPICAL: f64 = 0.2;
/// Bound, in masses of the body.
const GREATEST: f64 = 5.0;
/// First value of a fit, in masses of the body: at a mass of zero the position has no influence.
const FIRST: f64 = 0.02;
/// Prior of the position, in extents.
const AWAY: f64 = 0.3;
/// Bound of the position, in extents.
const FARTHEST: f64 = 1.5;

/// Parameters `mass` [kg]; `x`, `y`, `z` [m]: its place in the body's frame.
#[derive(Debug)]
pub struct Payload;

static CARD: Card = Card {
    id: Id::Payload,
    phrase: "a payload",
    target: TargetKind::Body,
    summary: "a point mass carried along, with its weight",
    equation: "F = m (g - a_r) at r, a_r = a + omega' x r + omega x (omega x r); it displaces no water",
    source: "R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, section 2.13 (spatial inertia)",
    idealised: false,
    placement: Placement::Mjcf,
};

impl Effect for Payload {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let mass = scale.typical_mass();
            let extent = scale.typical_extent();
            let length = scale.length();
            let mut parameters = vec![
                Parameter::about("mass", "kg", 0.0, TYPICAL * mass)
                    .within(0.0, GREATEST * mass)
                    .physically(Physical::NotNegative)
                    .starting(FIRST * mass),
            ];
            let places = axes::vector(
                "m",
                extent.map(|extent| AWAY * extent),
                [FARTHEST * length; 3],
            );
            parameters.extend(places.map(Parameter::shaping));
            parameters
        })
    }

    fn is_point_mass(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

impl WrenchLaw for Payload {
    const HAS_INERTIA: bool = true;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        let place = [p[1], p[2], p[3]];
        let centripetal = cross(flow.angular, cross(flow.angular, place));
        let falling = sum(constant(flow.gravity()), scaled(D::from(-1.0), centripetal));
        about_origin(scaled(p[0], falling), [D::from(0.0); 3], place)
    }

    fn added_inertia(&self, p: &Parameters<f64>, _flow: &Flow<f64>) -> Option<Matrix6<f64>> {
        Some(inertia_at([p[0].max(0.0); 3], [0.0; 3], [p[1], p[2], p[3]]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn it_weighs_where_it_is() {
        let motion = fixture::still();
        let wrench = Payload.wrench(&[2.0, 0.1, 0.0, 0.0], &motion, &[]);
        assert_eq!(wrench[2], -2.0 * 9.81);
        assert!((wrench[4] - 0.1 * 2.0 * 9.81).abs() < 1e-12);
    }

    #[test]
    fn its_inertia_is_the_parallel_axis_theorem() {
        let motion = fixture::still();
        let inertia = Payload
            .inertia(&[2.0, 0.3, 0.0, 0.4], &motion)
            .expect("a payload has inertia");
        assert!((inertia[(0, 0)] - 2.0).abs() < 1e-12);
        assert!((inertia[(3, 3)] - 2.0 * 0.16).abs() < 1e-12);
        assert!((inertia[(4, 4)] - 2.0 * 0.25).abs() < 1e-12);
        assert!((inertia[(5, 5)] - 2.0 * 0.09).abs() < 1e-12);
        assert!((inertia[(3, 5)] + 2.0 * 0.12).abs() < 1e-12);
    }
}
