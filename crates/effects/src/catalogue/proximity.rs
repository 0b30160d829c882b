//! A boundary near a body, surface or wall: extra drag and added mass in proportion to exp(-distance / length).
//!
//! Both are computed on a reference body with the extents of the true one (drag of strips with a coefficient of one,
//! added mass of the ellipsoid in an ideal fluid), so that four numbers stand for twelve.

use nalgebra::Matrix6;

use super::{
    added_mass::{inertia_at, kirchhoff},
    ellipsoid,
};
use crate::{
    Parameter, Physical,
    card::BodyScale,
    dual::{Scalar, constant, dot, real, scaled, signed_square, sum, times},
    flow::Flow,
    wrench_law::{Parameters, about_origin},
};

/// Parameters of an effect of a boundary.
pub(super) fn parameters(scale: &BodyScale) -> Vec<Parameter> {
    let (speed, length) = (scale.typical_speed(), scale.length());
    vec![
        Parameter::about("linear_drag", "m/s", 0.0, speed)
            .within(0.0, 20.0)
            .physically(Physical::NotNegative),
        Parameter::about("quadratic_drag", "1", 0.0, 1.0)
            .within(0.0, 50.0)
            .physically(Physical::NotNegative),
        Parameter::about("added_mass", "1", 0.0, 0.5)
            .within(0.0, 20.0)
            .physically(Physical::NotNegative),
        // Of the order of half the body: an image's flow and a body's waves die away over its own size.
        Parameter::about("length", "m", 0.5 * length, 0.25 * length)
            .within(0.02 * length, 20.0 * length)
            .physically(Physical::Positive)
            .shaping(),
    ]
}

/// A boundary: how far it is [m], and the unit vector away from it in the body's frame.
pub(super) struct Boundary {
    pub(super) distance: f64,
    pub(super) away: [f64; 3],
}

/// A length [m] that can be divided by: none below a tenth of a millimetre.
fn positive_length<D: Scalar>(p: &Parameters<D>) -> D {
    const SHORTEST: f64 = 1e-4;
    if real(p[3]) < SHORTEST {
        D::from(SHORTEST)
    } else {
        p[3]
    }
}

/// exp(-distance / length), one at the boundary and beyond it.
fn nearness<D: Scalar>(length: D, boundary: &Boundary) -> D {
    (D::from(-boundary.distance.clamp(0.0, 1e6)) / length).exp()
}

/// Wrench of the extra drag and the extra added mass, without the part in proportion to acceleration.
pub(super) fn wrench<D: Scalar>(p: &Parameters<D>, boundary: &Boundary, flow: &Flow<D>) -> [D; 6] {
    let length = positive_length(p);
    let near = nearness(length, boundary);
    let (v, omega) = (flow.linear_at_middle(), flow.angular);
    let half_density = 0.5 * flow.density();
    let extent = flow.extent();

    // Drag: strips feel 1/2 rho b (u + c |s|) s, s their speed.
    let (mut force, mut torque) = ([D::from(0.0); 3], [D::from(0.0); 3]);
    for axis in 0..3 {
        let (j, k) = (extent[(axis + 1) % 3], extent[(axis + 2) % 3]);
        let area = std::f64::consts::FRAC_PI_4 * j * k;
        let cubes = extent[axis] * (j.powi(3) + k.powi(3)) / 12.0;
        let fourths = extent[axis] * (j.powi(4) + k.powi(4)) / 32.0;
        let drag = |speed: D, linear: f64, quadratic: f64| {
            -near * half_density * (p[0] * speed * linear + p[1] * signed_square(speed) * quadratic)
        };
        force[axis] = drag(v[axis], area, area);
        torque[axis] = drag(omega[axis], cubes, fourths);
    }
    let drag = about_origin(force, torque, constant(flow.middle()));

    // Added mass: Kirchhoff's, and, as it changes with distance, Lagrange's: the part of -M' v that is not
    // in acceleration, and the gradient of the kinetic energy, which draws the body to the boundary.
    let (mass, inertia) = reference(flow);
    let factor = p[2] * near;
    let mass = scaled(factor, constant(mass));
    let inertia = scaled(factor, constant(inertia));
    let steady = kirchhoff(mass, inertia, flow);
    let mut changing = [D::from(0.0); 6];
    if boundary.distance > 0.0 {
        let away = constant(boundary.away);
        let (momentum, spin) = (times(mass, v), times(inertia, omega));
        let rate = dot(away, v) / length;
        let pull = -(dot(momentum, v) + dot(spin, omega)) * 0.5 / length;
        let force = sum(scaled(rate, momentum), scaled(pull, away));
        changing = about_origin(force, scaled(rate, spin), constant(flow.middle()));
    }
    std::array::from_fn(|row| drag[row] + steady[row] + changing[row])
}

/// The extra added mass.
pub(super) fn inertia(p: &Parameters<f64>, boundary: &Boundary, flow: &Flow<f64>) -> Matrix6<f64> {
    let factor = p[2].max(0.0) * nearness(positive_length(p), boundary);
    let (mass, inertia) = reference(flow);
    inertia_at(
        mass.map(|mass| factor * mass),
        inertia.map(|inertia| factor * inertia),
        flow.middle(),
    )
}

/// Added mass [kg] and inertia [kg m^2] of the ellipsoid, for the displaced mass.
fn reference<D: Scalar>(flow: &Flow<D>) -> ([f64; 3], [f64; 3]) {
    let displaced = flow.density() * flow.volume();
    let (mass, inertia) = ellipsoid::added_mass(flow.extent());
    (
        mass.map(|share| share * displaced),
        inertia.map(|share| share * displaced),
    )
}
