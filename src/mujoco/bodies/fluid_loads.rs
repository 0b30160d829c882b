//! MuJoCo's own fluid, a body at a time, where its joint-space sum will not do.

use std::ffi::c_int;

use nalgebra::{Matrix3, Vector3};

use super::joint_space::{rotation, vector};
use crate::{
    mujoco::ffi::{
        DataView, ModelView,
        bindings::{mjGEOM_CAPSULE, mjGEOM_CYLINDER, mjGEOM_SPHERE},
    },
    plugin::native_fluid::{self, EllipsoidCoefficients, Fluid, Load, Motion},
};

/// Lightest body that MuJoCo's fluid acts on [kg].
const LIGHTEST: f64 = 1e-15;

/// Velocity of a point of a body in the world [m/s], and the body's angular velocity [rad/s].
pub(crate) fn velocity(
    data: &DataView<'_>,
    body: usize,
    at: Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let velocity = &data.cvel()[6 * body..6 * body + 6];
    let angular = Vector3::new(velocity[0], velocity[1], velocity[2]);
    let centre = vector(
        data.subtree_com(),
        data.model().body_rootid()[body] as usize,
    );
    let linear =
        Vector3::new(velocity[3], velocity[4], velocity[5]) + angular.cross(&(at - centre));
    (linear, angular)
}

/// Coefficients of a geom.
pub(crate) fn coefficients(model: ModelView<'_>, geom: usize) -> EllipsoidCoefficients {
    let (rows, _) = model
        .geom_fluid()
        .as_chunks::<{ EllipsoidCoefficients::LEN }>();
    EllipsoidCoefficients::from_row(&rows[geom])
}

/// Forces of MuJoCo's fluid on a body: `each` gets a point, and force and torque there, in the world.
/// `water` is the velocity of the water [m/s] at a point of the world.
pub(crate) fn loads(
    data: &DataView<'_>,
    body: usize,
    water: impl Fn(Vector3<f64>) -> Vector3<f64>,
    mut each: impl FnMut(Vector3<f64>, Vector3<f64>, Vector3<f64>),
) {
    let model = data.model();
    let option = &model.raw().opt;
    let fluid = Fluid {
        density: option.density,
        viscosity: option.viscosity,
    };
    let mass = model.body_mass()[body];
    if (fluid.density <= 0.0 && fluid.viscosity <= 0.0) || mass < LIGHTEST {
        return;
    }
    let motion = |at: Vector3<f64>, frame: &Matrix3<f64>| {
        let (linear, angular) = velocity(data, body, at);
        Motion {
            angular: frame.tr_mul(&angular),
            linear: frame.tr_mul(&(linear - water(at))),
        }
    };
    let mut put = |at: Vector3<f64>, frame: &Matrix3<f64>, load: Load| {
        each(at, frame * load.force, frame * load.torque);
    };
    let mut any = false;
    for geom in model.geoms(body) {
        let coefficients = coefficients(model, geom);
        if coefficients.interaction <= 0.0 {
            continue;
        }
        any = true;
        let (at, frame) = (
            vector(data.geom_xpos(), geom),
            rotation(data.geom_xmat(), geom),
        );
        let size = ModelView::triple(model.geom_size(), geom);
        let axes = semi_axes(model.geom_type()[geom], size);
        let load = native_fluid::ellipsoid(axes, &coefficients, fluid, motion(at, &frame));
        put(at, &frame, load);
    }
    if !any {
        let inertia = ModelView::triple(model.body_inertia(), body);
        let (at, frame) = (vector(data.xipos(), body), rotation(data.ximat(), body));
        let load = native_fluid::inertia_box(mass, inertia, fluid, motion(at, &frame));
        put(at, &frame, load);
    }
}

/// Semi-axes of the ellipsoid that stands for a geom, as MuJoCo takes them.
fn semi_axes(kind: c_int, [a, b, c]: [f64; 3]) -> [f64; 3] {
    match kind as u32 {
        kind if kind == mjGEOM_SPHERE => [a, a, a],
        kind if kind == mjGEOM_CAPSULE => [a, a, a + b],
        kind if kind == mjGEOM_CYLINDER => [a, a, b],
        _ => [a, b, c],
    }
}
