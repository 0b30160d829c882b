//! Added mass: the water that accelerates with the body, `F = -(M_A a + C_A(v) v)`.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::{axes, coupling, whole_matrix};
use crate::{
    Card, Effect, Id, MatrixPart, Medium, Parameter, Part, Placement, Target, TargetKind,
    dual::{Scalar, constant, cross, scaled, sum, times},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Bound, in displaced masses: a thin plate, which displaces next to nothing, has many.
const GREATEST: f64 = 100.0;

/// Parameters `surge`, `sway`, `heave` [kg], `roll`, `pitch`, `yaw` [kg m^2]: the diagonal of M_A at the middle of the
/// body, in its frame; or a whole matrix ([`MatrixPart`]).
#[derive(Debug)]
pub struct AddedMass;

static CARD: Card = Card {
    id: Id::AddedMass,
    phrase: "added mass",
    target: TargetKind::Body,
    summary: "water that is accelerated with the body",
    equation: "F = -(M_A nu_r' + C_A(nu_r) nu_r), diagonal M_A at the middle of the body, in its frame; \
               with C_A nu_r = (omega x M_1 v, v x M_1 v + omega x M_2 omega); accelerating water adds M_1 a_w",
    source: "H. Lamb, Hydrodynamics, 6th ed. 1932, articles 121-124 (Kirchhoff's equations); T. I. Fossen, \
             Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 6.3",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for AddedMass {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            axes::never_negative(["kg", "kg m^2"], |axis| {
                let greatest = GREATEST * scale.displaced_about(axis);
                (scale.expected_added_mass(axis).min(greatest), greatest)
            })
        })
    }

    fn is_additive(&self) -> bool {
        true
    }

    fn is_of_every_fluid(&self) -> bool {
        true
    }

    /// Off-diagonal elements of M_A, with their part of C_A (Fossen, theorem 3.2).
    fn neglected_terms(&self, p: &[f64], nu: &[f64; 6], nu_dot: &[f64; 6]) -> Vec<[f64; 6]> {
        let momenta = coupling::symmetric(p, nu).into_iter();
        let changes = coupling::symmetric(p, nu_dot);
        let part = |of: &[f64; 6], first: usize| Vector3::from_column_slice(&of[first..first + 3]);
        let (v, omega) = (part(nu, 0), part(nu, 3));
        momenta
            .zip(changes)
            .map(|(momentum, change)| {
                let (linear, angular) = (part(&momentum, 0), part(&momentum, 3));
                let force = part(&change, 0) + omega.cross(&linear);
                let torque = part(&change, 3) + omega.cross(&angular) + v.cross(&linear);
                [force.x, force.y, force.z, torque.x, torque.y, torque.z].map(|value| -value)
            })
            .collect()
    }

    /// A fluid dense enough to be carried along drags too.
    fn presupposes(&self) -> &'static [Id] {
        Id::DRAGS
    }

    fn is_refinement(&self) -> bool {
        false
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }

    fn matrix_part(&self) -> Option<&dyn MatrixPart> {
        Some(&whole_matrix::ADDED_MASS)
    }
}

impl WrenchLaw for AddedMass {
    const HAS_INERTIA: bool = true;

    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, _memory: &[f64]) -> [D; 6] {
        kirchhoff([p[0], p[1], p[2]], [p[3], p[4], p[5]], flow)
    }

    fn added_inertia(&self, p: &Parameters<f64>, flow: &Flow<f64>) -> Option<Matrix6<f64>> {
        Some(inertia_at(
            [p[0], p[1], p[2]],
            [p[3], p[4], p[5]],
            flow.middle(),
        ))
    }
}

/// The added-mass force without the part in proportion to the body's acceleration.
///
/// [`BodyPart::inertia`] multiplies the acceleration of the origin as the world sees it, a. At the
/// middle r that is a + omega' x r + omega x (omega x r), and the components of the relative velocity v
/// there change by v' = a_middle - a_w - omega x v in water that itself accelerates by a_w. So
/// `-(M_1 v' + omega x M_1 v)` leaves, beside the part in a and omega',
/// `M_1 (a_w + omega x v - omega x (omega x r)) - omega x M_1 v`.
pub(super) fn kirchhoff<D: Scalar>(mass: [D; 3], inertia: [D; 3], flow: &Flow<D>) -> [D; 6] {
    let (v, omega) = (flow.linear_at_middle(), flow.angular);
    let middle = constant(flow.middle());
    let momentum = times(mass, v);
    let minus = D::from(-1.0);

    let frame = sum(
        cross(omega, v),
        scaled(minus, cross(omega, cross(omega, middle))),
    );
    let carried = sum(constant(flow.water_acceleration()), frame);
    let force = sum(times(mass, carried), cross(momentum, omega));
    let torque = sum(cross(momentum, v), cross(times(inertia, omega), omega));
    about_origin(force, torque, middle)
}

/// Mass and inertia, diagonal at a point r [m] of the body, for (linear, angular) acceleration of the origin:
/// H^T M H with H = [1, -r x; 0, 1].
pub(crate) fn inertia_at(mass: [f64; 3], inertia: [f64; 3], point: [f64; 3]) -> Matrix6<f64> {
    let mass = Matrix3::from_diagonal(&Vector3::from(mass));
    let inertia = Matrix3::from_diagonal(&Vector3::from(inertia));
    let lever = Vector3::from(point).cross_matrix();
    let mut about_origin = Matrix6::zeros();
    about_origin.fixed_view_mut::<3, 3>(0, 0).copy_from(&mass);
    about_origin
        .fixed_view_mut::<3, 3>(0, 3)
        .copy_from(&(-mass * lever));
    about_origin
        .fixed_view_mut::<3, 3>(3, 0)
        .copy_from(&(lever * mass));
    about_origin
        .fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&(inertia - lever * mass * lever));
    about_origin
}
