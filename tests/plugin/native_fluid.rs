//! Our words for MuJoCo's two fluid models, held against `qfrc_fluid`.
#![cfg(mujoco_plugins)]

use std::sync::Arc;

use hydro_plugin::{
    mujoco::simulator::{Data, Model},
    plugin::native_fluid::{EllipsoidCoefficients, Fluid, Load, Motion, ellipsoid, inertia_box},
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};

const FLUID: Fluid = Fluid {
    density: 1000.0,
    viscosity: 0.7,
};

/// A free body of one geom; `fluid` are the geom's own attributes.
fn body(geom: &str) -> Data {
    let xml = format!(
        "<mujoco><option density=\"1000\" viscosity=\"0.7\" wind=\"0.1 -0.2 0.3\"/>\
         <worldbody><body name=\"b\"><freejoint/><geom {geom}/></body></worldbody></mujoco>"
    );
    Data::new(&Arc::new(Model::from_xml(&xml).unwrap())).unwrap()
}

/// Compares on random motions: force in the world, torque in the body, about the body's origin.
fn compare(mut data: Data, frame: UnitQuaternion<f64>, ours: impl Fn(Motion) -> Load) {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let mut draw = || random.random_range(-1.0..1.0_f64);
    for _ in 0..50 {
        let q = UnitQuaternion::from_quaternion(Quaternion::new(draw(), draw(), draw(), draw()));
        let (v, w) = (
            Vector3::new(draw(), draw(), draw()),
            3.0 * Vector3::new(draw(), draw(), draw()),
        );
        data.qpos_mut()[3..7].copy_from_slice(&[q.w, q.i, q.j, q.k]);
        data.qvel_mut()[..3].copy_from_slice(v.as_slice());
        data.qvel_mut()[3..].copy_from_slice(w.as_slice());
        data.forward();
        let relative = v - Vector3::new(0.1, -0.2, 0.3);
        let motion = Motion {
            angular: frame.inverse() * w,
            linear: frame.inverse() * (q.inverse() * relative),
        };
        let load = ours(motion);
        let force = q * (frame * load.force);
        let torque = frame * load.torque;
        let scale = force.norm() + torque.norm();
        assert!(scale > 1.0, "nothing to compare");
        for (got, want) in force.iter().chain(torque.iter()).zip(data.qfrc_fluid()) {
            assert!(
                (got - want).abs() < 1e-9 * scale,
                "{force} {torque} {:?}",
                data.qfrc_fluid()
            );
        }
    }
}

#[test]
fn the_ellipsoid_model() {
    for (kind, size, axes) in [
        ("ellipsoid", "0.3 0.1 0.2", [0.3, 0.1, 0.2]),
        ("sphere", "0.2", [0.2, 0.2, 0.2]),
        ("capsule", "0.1 0.3", [0.1, 0.1, 0.4]),
        ("cylinder", "0.1 0.3", [0.1, 0.1, 0.3]),
        ("box", "0.1 0.2 0.3", [0.1, 0.2, 0.3]),
    ] {
        let geom = format!(
            "type=\"{kind}\" size=\"{size}\" mass=\"3\" fluidshape=\"ellipsoid\" fluidcoef=\"0.6 0.3 1.2 0.8 0.9\""
        );
        let data = body(&geom);
        let row = data.model().geom_fluid(0);
        let coefficients = EllipsoidCoefficients::from_row(&row);
        assert!(coefficients.virtual_mass.norm() > 0.0);
        compare(data, UnitQuaternion::identity(), |motion| {
            ellipsoid(axes, &coefficients, FLUID, motion)
        });
    }
}

#[test]
fn the_inertia_box_model() {
    let data = body("type=\"box\" size=\"0.1 0.2 0.3\" mass=\"3\"");
    let inertia = data.model().inertia(1);
    let [w, x, y, z] = inertia.orientation;
    let frame = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    compare(data, frame, |motion| {
        inertia_box(inertia.mass, inertia.moments, FLUID, motion)
    });
}
