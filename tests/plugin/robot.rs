//! B1 twice: its URDF as urdf-rs reads it and its MJCF as MuJoCo compiles it must be the same robot.
// Debian's 2.2.2 cannot read what newer scenes say.
#![cfg(mujoco_plugins)]

use std::path::{Path, PathBuf};

use hydro_model::{features::FeatureLayout, robot::Robot};
use hydro_plugin::{mujoco::simulator::Model, plugin::JointKind};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn b1() -> (Robot, Model) {
    let robot = Robot::from_urdf(&project("models/robots/b1.urdf")).unwrap();
    let model = Model::load(&project("mjcf/b1.xml")).unwrap();
    (robot, model)
}

/// Bodies that the URDF fuses into its root are the MJCF's `trunk`.
fn body_in_mjcf<'a>(robot: &Robot, name: &'a str) -> &'a str {
    if name == robot.bodies[0].name {
        "trunk"
    } else {
        name
    }
}

#[test]
fn the_numbers_published_for_b1_are_there() {
    let (robot, _) = b1();
    assert!((robot.mass() - 62.580).abs() < 1e-9, "{}", robot.mass());
    assert_eq!(robot.joints.len(), 12);
    let legs = ["FR", "FL", "RR", "RL"];
    let order: Vec<String> = legs
        .iter()
        .flat_map(|leg| ["hip", "thigh", "calf"].map(|part| format!("{leg}_{part}_joint")))
        .collect();
    assert_eq!(robot.joint_names(), order);
    assert_eq!(FeatureLayout::floating_base(&order).unwrap().len(), 35);
}

#[test]
fn masses_centres_and_inertias_agree() {
    let (robot, model) = b1();
    assert_eq!(robot.bodies.len(), 13);
    for body in &robot.bodies {
        let name = body_in_mjcf(&robot, &body.name);
        let compiled = model.inertia(model.body(name).unwrap());
        assert!(
            (compiled.mass - body.inertia.mass).abs() < 1e-9,
            "{name}: mass {}",
            compiled.mass
        );
        let offset = (Vector3::from(compiled.centre) - body.inertia.centre).norm();
        assert!(offset < 1e-9, "{name}: centre of mass off by {offset} m");
        let [w, x, y, z] = compiled.orientation;
        let axes =
            UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
        let tensor =
            axes * Matrix3::from_diagonal(&Vector3::from(compiled.moments)) * axes.transpose();
        let off = (tensor - body.inertia.tensor).abs().max();
        assert!(off < 1e-9, "{name}: inertia off by {off} kg m^2");
    }
}

#[test]
fn joints_agree_in_order_axis_place_and_limits() {
    let (robot, model) = b1();
    let joints = model.joints();
    assert_eq!(joints[0].kind, JointKind::Free);
    assert_eq!(joints.len(), 13);
    for (index, joint) in robot.joints.iter().enumerate() {
        assert_eq!(joints[index + 1].name, joint.name);
        // Qpos and qvel follow the URDF's order: the features need no permutation.
        assert_eq!(
            (joints[index + 1].qpos, joints[index + 1].dof),
            (7 + index, 6 + index)
        );
        let compiled = model.joint_geometry(&joint.name).unwrap();
        assert_eq!(compiled.body, joint.child);
        assert!(
            (Vector3::from(compiled.axis) - joint.axis).norm() < 1e-12,
            "{}",
            joint.name
        );
        for (compiled, limit) in compiled.range.iter().zip(joint.range) {
            assert!(
                (compiled - limit).abs() < 1e-9,
                "{}: {compiled} {limit}",
                joint.name
            );
        }
        let body = model.body(&joint.child).unwrap();
        let place =
            Vector3::from(model.body_position(body)) - joint.parent_from_child.translation.vector;
        assert!(
            place.norm() < 1e-9,
            "{}: frame off by {}",
            joint.name,
            place.norm()
        );
        assert_eq!(
            model.body_names()[model.parent(body)],
            body_in_mjcf(&robot, &joint.parent)
        );
    }
}
