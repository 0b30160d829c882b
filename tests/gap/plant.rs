//! Effects in MuJoCo, through the plant of `hydro gap` and through the attribute `effects`: closed forms,
//! the same model with real masses, energy, and the two against each other.
#![cfg(mujoco_plugins)]

use std::{fs, path::PathBuf, sync::Arc};

use hydro_effects::{Entry, Id, Medium};
use hydro_frames::Wrench;
use hydro_gap::plant::{NuisanceClass, Plant, Quantity, SensorKind, Simulation};
use hydro_plugin::mujoco::{
    plant::MujocoPlant,
    simulator::{Data, Model},
};
use nalgebra::DVector;
use rayon::prelude::*;

/// A scene in a folder of its own.
struct Scene {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    fs::write(&path, text).unwrap();
    Scene {
        _folder: folder,
        path,
    }
}

fn plant(text: &str) -> MujocoPlant {
    MujocoPlant::load(&scene(text).path).unwrap()
}

fn entry(effect: Id, target: &str, parameters: &[f64]) -> Entry {
    Entry {
        effect,
        target: target.to_owned(),
        parameters: parameters.to_vec(),
    }
}

fn simulation(plant: &MujocoPlant, effects: &[Entry]) -> Box<dyn Simulation> {
    let nuisances = vec![0.0; plant.description().nuisances.len()];
    plant.simulation(&nuisances, effects).unwrap()
}

/// A box of 2 kg in nothing, with an accelerometer and a thruster along x.
fn hull(option: &str, inside: &str) -> String {
    format!(
        r#"<mujoco><option {option}/>
        <worldbody>
          <body name="hull"><freejoint/>
            <geom type="box" size="0.3 0.2 0.1" mass="2"/>
            <site name="imu"/>{inside}
          </body>
        </worldbody>
        <actuator><motor name="thruster" site="imu" gear="1 0 0 0 0 0"/></actuator>
        <sensor>
          <accelerometer name="acceleration" site="imu" noise="0.02"/>
          <framepos name="position" objtype="body" objname="hull"/>
          <gyro name="gyro" site="imu"/>
        </sensor></mujoco>"#
    )
}

/// Memories that are brought along a motion without its steps are those that the steps leave: of the water about a body, and of
/// an actuator.
#[test]
fn memories_along_a_motion_are_those_of_its_steps() {
    let plant = plant(&hull(r#"timestep="0.004" gravity="0 0 0""#, ""));
    let effects = [
        entry(Id::WakeMemory, "hull", &[4.0, 5.0, 6.0, 0.1, 0.2, 0.3, 2.5]),
        entry(Id::BassetHistory, "hull", &[1.0, 2.0, 3.0]),
        entry(Id::ActuatorLag, "thruster", &[0.1]),
    ];
    let (mut stepped, mut along) = (simulation(&plant, &effects), simulation(&plant, &effects));
    let start = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    stepped.set_motion(0.0, &start, &[0.4, -0.2, 0.1, 0.5, -0.7, 0.3]);
    along.rejoin(&stepped.full_state());
    for step in 0..50 {
        let command = [(0.2 * f64::from(step)).sin()];
        stepped.set_control(&command);
        stepped.step();
        along.set_control(&command);
        along.remember(&stepped.full_state());
    }
    let (expected, found) = (stepped.memory(), along.memory());
    assert!(expected.iter().filter(|value| **value != 0.0).count() > 10);
    for (expected, found) in expected.iter().zip(&found) {
        assert!((expected - found).abs() < 1e-9, "{expected} {found}");
    }
}

/// Gravity counts along an axis that stands still in the world; where the axis may turn it counts in full. A servo's damping
/// is the joint's.
#[test]
fn a_joints_sizes_know_its_axis_and_its_servo() {
    let plant = plant(
        r#"<mujoco>
        <worldbody>
          <body name="cart"><joint name="level" type="slide" axis="1 0 0"/><joint name="lift" type="slide" axis="0 0 1"/>
            <joint name="turn" axis="0 0 1" damping="0.5"/><geom type="box" size="0.1 0.1 0.1" mass="2"/>
            <body name="arm"><joint name="shoulder" axis="0 1 0"/>
              <geom type="box" size="0.2 0.05 0.05" pos="0.2 0 0" mass="1"/>
            </body>
          </body>
        </worldbody>
        <actuator><position name="servo" joint="turn" kp="50" kv="3"/></actuator>
        <sensor><jointpos name="q" joint="turn"/></sensor></mujoco>"#,
    );
    let scale = |name: &str| {
        let mut joints = plant.description().joints.iter();
        joints.find(|of| of.name == name).unwrap().scale.clone()
    };
    assert_eq!(scale("level").torque, 0.0);
    assert!((scale("lift").torque - 3.0 * 9.81).abs() < 1e-9);
    assert_eq!(scale("turn").torque, 0.0);
    assert!((scale("shoulder").torque - 0.2 * 9.81).abs() < 1e-9);
    assert!((scale("turn").damping - 3.5).abs() < 1e-12);
    let mut ends = plant.description().bodies.iter();
    assert!(ends.all(|of| of.end == (of.name == "arm")));
}

/// Joints that only say where a body is in a plane; not a cart's rail, not a spindle along its own axis, not what has a spring, a
/// damper, friction or a rotor.
#[test]
fn coordinates_of_motion_in_a_plane_are_no_mechanisms() {
    let driven = |joints: &str, inside: &str, actuator: &str| -> Vec<String> {
        let text = format!(
            r#"<mujoco><worldbody><body name="root">{joints}<geom size="0.1" mass="1"/>{inside}</body></worldbody>
            <actuator>{actuator}</actuator><sensor><jointpos name="q" joint="a"/></sensor></mujoco>"#
        );
        let plant = plant(&text);
        let joints = plant.description().joints.iter();
        let found = joints.filter(|joint| joint.is_coordinate);
        found.map(|joint| joint.name.clone()).collect()
    };
    let coordinates = |joints: &str, inside: &str| driven(joints, inside, "");
    let [x, z] = [
        r#"<joint name="a" type="slide" axis="1 0 0"/>"#,
        r#"<joint name="b" type="slide" axis="0 0 1"/>"#,
    ];
    let pitch = r#"<joint name="c" axis="0 1 0"/>"#;
    let servo = |kind: &str, gains: &str| {
        let actuator = format!(r#"<{kind} name="servo" joint="c" {gains}/>"#);
        driven(&[x, z, pitch].concat(), "", &actuator)
    };
    let limb =
        r#"<body pos="0 0 -1"><joint name="d" axis="0 1 0"/><geom size="0.1" mass="1"/></body>"#;
    assert_eq!(coordinates(&[x, z, pitch].concat(), limb), ["a", "b", "c"]);
    assert_eq!(coordinates(x, limb), [""; 0]);
    assert_eq!(coordinates(&[x, z].concat(), ""), [""; 0]);
    assert_eq!(
        coordinates(&[x, r#"<joint name="c" axis="1 0 0"/>"#].concat(), ""),
        [""; 0]
    );
    for passive in [
        "stiffness='0.1'",
        "stiffness='0 0 0.1'",
        "damping='0.1'",
        "frictionloss='0.1'",
        "armature='0.1'",
        "range='-60 60'",
    ] {
        let c = format!(r#"<joint name="c" axis="0 1 0" {passive}/>"#);
        assert_eq!(
            coordinates(&[x, z, &c].concat(), ""),
            ["a", "b"],
            "{passive}"
        );
    }
    let inner = format!(r#"<body>{z}{pitch}<geom size="0.1" mass="1"/></body>"#);
    assert_eq!(coordinates(x, &inner), [""; 0]);
    assert_eq!(servo("position", "kp='9' kv='3'"), ["a", "b"]);
    assert_eq!(servo("motor", ""), ["a", "b", "c"]);
}

/// A slide across the vertical keeps its depth, unless something above it turns.
#[test]
fn slides_that_keep_their_depth_are_told_from_others() {
    let level = |outer: &str, inner: &str, turned: &str| -> Vec<bool> {
        let text = format!(
            r#"<mujoco><worldbody><body euler="{turned}">{outer}<geom size="0.1" mass="1"/>
            <body>{inner}<geom size="0.1" mass="1"/></body></body></worldbody></mujoco>"#
        );
        let plant = plant(&text);
        let joints = plant.description().joints.iter();
        joints.map(|joint| joint.is_level).collect()
    };
    let [x, y, z] =
        ["1 0 0", "0 1 0", "0 0 1"].map(|axis| format!(r#"<joint type="slide" axis="{axis}"/>"#));
    let hinge = r#"<joint axis="0 1 0"/>"#;
    assert_eq!(level(&x, &z, "0 0 0"), [true, false]);
    assert_eq!(level(&z, &y, "0 0 30"), [false, true]);
    assert_eq!(level(&x, &z, "0 90 0"), [false, true]);
    assert_eq!(level(&x, &y, "0 1 0"), [false, true]);
    assert_eq!(level(hinge, &x, "0 0 0"), [false, false]);
    assert_eq!(
        level(&format!("{x}{hinge}"), &y, "0 0 0"),
        [true, false, false]
    );
    assert_eq!(level(&x, hinge, "0 0 0"), [true, false]);
}

/// Buoyancy is left out where nothing carries a body's weight, or that of what hangs below a root.
#[test]
fn buoyancy_that_a_model_leaves_out_is_told() {
    let geom = r#"<geom type="box" size="0.1 0.1 0.1" mass="3"/>"#;
    let left_out = |instance: &str, bob: &str, inside: &str| -> Vec<f64> {
        let text = format!(
            r#"<mujoco>{instance}<worldbody><body name="bob" {bob}><joint type="slide" axis="0 0 1"/>
            {geom}{inside}</body></worldbody></mujoco>"#
        );
        let plant = plant(&text);
        let bodies = plant.description().bodies.iter();
        bodies.map(|of| of.scale.buoyancy_left_out).collect()
    };
    let wet = |effect: &str| {
        let effects = format!(r#"{{"schema": "hydro-effects/1", "effects": [{effect}]}}"#);
        format!(
            r#"<extension><plugin plugin="hydro.wrench"><instance name="w"><config key="waterline" value="0"/>
            <config key="effects" value='{effects}'/></instance></plugin></extension>"#
        )
    };
    let carried = r#"<plugin plugin="hydro.wrench" instance="w"/>"#;
    let of = |id: &str, parameters: &str| {
        wet(&format!(
            r#"{{"effect": "{id}", "target": "bob", "parameters": {{{parameters}}}}}"#
        ))
    };
    let [whole] = left_out("", "", "")[..] else {
        panic!("one body")
    };
    assert!((whole - 1000.0 * 0.008 * 9.81).abs() < 1e-9, "{whole}");
    assert_eq!(left_out("", r#"gravcomp="0.9""#, ""), [0.0]);
    assert_eq!(left_out(&of("hydrostatics", ""), "", carried), [0.0]);
    assert_eq!(
        left_out(&of("net_buoyancy", r#""force": 1"#), "", carried),
        [0.0]
    );
    let drag = r#""surge": 1, "sway": 1, "heave": 1, "roll": 0, "pitch": 0, "yaw": 0"#;
    let dry = left_out(&of("linear_drag", drag), "", carried);
    assert!((dry[0] - whole).abs() < 1e-9, "{dry:?}");
    let tail = format!(r#"<body gravcomp="1"><joint/>{geom}</body>"#);
    assert_eq!(left_out("", "", &tail), [0.0, 0.0]);
}

/// A body's Jacobian times the velocities is what a velocimeter and a gyro at its origin read; of no body it is zero.
#[test]
fn a_jacobian_gives_the_velocities_that_sensors_read() {
    let plant = plant(
        r#"<mujoco><option gravity="0 0 0" timestep="1e-6"/>
        <worldbody>
          <body name="carriage"><joint name="along" type="slide" axis="1 0.2 0"/><joint name="yaw" axis="0 0 1"/>
            <geom type="box" size="0.3 0.2 0.1" mass="2"/>
            <body name="arm" pos="0.3 0.1 -0.2" euler="20 40 10"><joint name="shoulder" axis="0 1 0.3"/>
              <geom type="box" size="0.2 0.05 0.05" pos="0.2 0 0" mass="1"/><site name="origin"/>
              <body name="ball" pos="0.4 0 0"><joint name="wrist" type="ball"/>
                <geom type="sphere" size="0.05" mass="0.3"/><site name="tip"/>
              </body>
            </body>
          </body>
        </worldbody>
        <sensor>
          <velocimeter name="v" site="origin"/><gyro name="w" site="origin"/>
          <velocimeter name="vt" site="tip"/><gyro name="wt" site="tip"/>
        </sensor></mujoco>"#,
    );
    let mut simulation = simulation(&plant, &[]);
    let half = 0.5_f64.sqrt();
    let qpos = [0.3, 0.7, -0.4, half, 0.0, half, 0.0];
    let qvel = [0.5, -1.1, 0.8, 0.3, -0.6, 0.9];
    simulation.set_motion(0.0, &qpos, &qvel);
    simulation.step();
    let read = simulation.sensors().to_vec();
    simulation.set_motion(0.0, &qpos, &qvel);
    for (body, read) in [("arm", &read[..6]), ("ball", &read[6..12])] {
        let found = simulation.body_jacobian(body) * DVector::from_column_slice(&qvel);
        for (found, read) in found.iter().zip(read) {
            assert!((found - read).abs() < 1e-9, "{body}: {found} for {read}");
        }
    }
    let none = simulation.body_jacobian("nobody");
    assert_eq!((none.shape(), none.norm()), ((6, 6), 0.0));
    // What was looked at is as it was.
    assert_eq!(
        (simulation.qpos(), simulation.qvel()),
        (&qpos[..], &qvel[..])
    );
}

const INTEGRATORS: [&str; 4] = ["Euler", "implicit", "implicitfast", "RK4"];

#[test]
fn a_base_wrench_turns_with_the_base_and_outlives_a_new_state() {
    for integrator in INTEGRATORS {
        let plant = plant(&hull(
            &format!("integrator=\"{integrator}\" gravity=\"0 0 0\""),
            "",
        ));
        assert_eq!(plant.description().base.as_ref().unwrap().body, "hull");
        let mut simulation = simulation(&plant, &[]);
        simulation.set_base_wrench(Wrench {
            force: [3.0, 0.0, 0.0],
            torque: [0.0, 0.0, 0.01],
        });
        simulation.reset();
        // Turned by a quarter about z, the base's x is the world's y.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let qpos = [0.0, 0.0, 0.0, half, 0.0, 0.0, half];
        simulation.set_motion(0.0, &qpos, &[0.0; 6]);
        simulation.step();
        let step = plant.description().timestep;
        let inertia = 2.0 / 3.0 * (0.3 * 0.3 + 0.2 * 0.2);
        let expected = [0.0, 1.5 * step, 0.0, 0.0, 0.0, 0.01 / inertia * step];
        for (found, expected) in simulation.qvel().iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-9,
                "{integrator}: {:?}",
                simulation.qvel()
            );
        }
        simulation.set_base_wrench(Wrench::default());
        simulation.set_motion(0.0, &qpos, &[0.0; 6]);
        simulation.step();
        assert!(simulation.qvel().iter().all(|value| value.abs() < 1e-12));
    }
}

#[test]
fn a_free_body_accelerates_with_its_effective_mass() {
    for integrator in INTEGRATORS {
        let plant = plant(&hull(
            &format!(r#"gravity="0 0 0" integrator="{integrator}""#),
            "",
        ));
        // Five times its own mass along x.
        let added = entry(Id::AddedMass, "hull", &[10.0, 4.0, 7.0, 0.1, 0.2, 0.3]);
        let mut simulation = simulation(&plant, &[added]);
        simulation.set_control(&[6.0]);
        for _ in 0..100 {
            simulation.step();
        }
        let step = plant.description().timestep;
        assert!(
            (simulation.qvel()[0] - 0.5 * 100.0 * step).abs() < 1e-12,
            "{integrator}"
        );
        assert!(
            (simulation.sensors()[0] - 0.5).abs() < 1e-12,
            "{integrator}"
        );
        assert_eq!(simulation.qvel()[1..], [0.0; 5], "{integrator}");
    }
}

/// Kirchhoff: in ideal fluid the energy of body and fluid together is conserved.
#[test]
fn a_tumbling_body_keeps_its_energy_in_ideal_fluid() {
    let plant = plant(&hull(
        r#"gravity="0 0 0" integrator="RK4" timestep="0.001""#,
        "",
    ));
    let added = [10.0, 4.0, 7.0, 0.1, 0.2, 0.3];
    let inertia = [
        2.0 / 3.0 * (0.04 + 0.01),
        2.0 / 3.0 * (0.09 + 0.01),
        2.0 / 3.0 * (0.09 + 0.04),
    ];
    let energy = |simulation: &dyn Simulation| {
        let (q, v) = (simulation.qpos(), simulation.qvel());
        let attitude = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            q[3], q[4], q[5], q[6],
        ));
        let linear = attitude.inverse() * nalgebra::Vector3::new(v[0], v[1], v[2]);
        (0..3)
            .map(|axis| {
                0.5 * (2.0 + added[axis]) * linear[axis].powi(2)
                    + 0.5 * (inertia[axis] + added[3 + axis]) * v[3 + axis].powi(2)
            })
            .sum::<f64>()
    };
    let mut simulation = simulation(&plant, &[entry(Id::AddedMass, "hull", &added)]);
    simulation.set_motion(
        0.0,
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        &[0.5, -0.3, 0.2, 1.0, 2.0, -0.5],
    );
    let before = energy(simulation.as_ref());
    for _ in 0..3000 {
        simulation.step();
    }
    let after = energy(simulation.as_ref());
    assert!((after / before - 1.0).abs() < 1e-8, "{before} {after}");
    // It was no steady motion.
    assert!(
        (simulation.qvel()[4] - 2.0).abs() > 0.1,
        "{:?}",
        simulation.qvel()
    );
}

/// A leg on a moving base, with a payload as an effect or as a body.
fn leg(payload: &str, option: &str) -> String {
    format!(
        r#"<mujoco><option {option}/>
        <worldbody>
          <body name="base"><freejoint/>
            <geom type="box" size="0.2 0.1 0.05" mass="3"/>
            <body name="thigh" pos="0.2 0 0">
              <joint name="hip" axis="0 1 0" damping="0.1"/>
              <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="1"/>
              <body name="calf" pos="0 0 -0.3" euler="10 20 0">
                <joint name="knee" axis="0 1 0" pos="0 0 0.01"/>
                <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.4"/>
                <site name="ankle" pos="0 0 -0.1"/>
                {payload}
              </body>
            </body>
          </body>
        </worldbody>
        <actuator><motor name="hip" joint="hip"/><motor name="knee" joint="knee"/></actuator>
        <sensor>
          <force name="force" site="ankle"/><torque name="torque" site="ankle"/>
          <jointpos name="hip_q" joint="hip"/>
          <accelerometer name="acceleration" site="ankle"/>
        </sensor></mujoco>"#
    )
}

fn assert_close(one: &[f64], other: &[f64], tolerance: f64, what: &str) {
    for (one, other) in one.iter().zip(other) {
        assert!((one - other).abs() <= tolerance, "{what}: {one} {other}");
    }
}

#[test]
fn a_payload_is_a_body_welded_on() {
    for option in [
        r#"integrator="Euler""#,
        r#"integrator="implicitfast""#,
        r#"integrator="RK4""#,
        r#"integrator="Euler" wind="0 0 0" gravity="1 0 -9""#,
    ] {
        let body = r#"<body pos="0.02 0.05 -0.25"><inertial pos="0 0 0" mass="2" diaginertia="1e-14 1e-14 1e-14"/></body>"#;
        let (light, heavy) = (plant(&leg("", option)), plant(&leg(body, option)));
        let load = entry(Id::Payload, "calf", &[2.0, 0.02, 0.05, -0.25]);
        let (mut one, mut other) = (simulation(&light, &[load]), simulation(&heavy, &[]));
        for step in 0..200 {
            for simulation in [&mut one, &mut other] {
                simulation.set_control(&[0.5 * (0.05 * f64::from(step)).sin(), 0.2]);
                simulation.step();
            }
        }
        assert_close(one.qpos(), other.qpos(), 1e-9, option);
        assert_close(one.qvel(), other.qvel(), 1e-9, option);
        assert_close(one.sensors(), other.sensors(), 1e-8, option);
    }
}

#[test]
fn constraints_feel_the_effective_mass() {
    // The payload in contact, with limits and a connected point, against the real thing.
    for option in [
        r#"solver="Newton""#,
        r#"solver="CG""#,
        r#"solver="PGS" iterations="500" tolerance="0""#,
        r#"solver="Newton" noslip_iterations="3""#,
        r#"cone="elliptic" integrator="implicitfast""#,
        r#"integrator="RK4""#,
        r#"integrator="discrete""#,
    ] {
        let text = |mass: f64| {
            format!(
                r#"<mujoco><option {option} timestep="0.001"/><worldbody>
                <geom type="plane" size="5 5 0.1"/>
                <body name="a" pos="0 0 0.12"><freejoint/>
                  <inertial pos="0 0 0" mass="{mass}" diaginertia="0.02 0.02 0.02"/>
                  <geom type="box" size="0.1 0.1 0.1"/><body/></body>
                <body name="b" pos="1 0 0.12"><joint name="s" type="slide" axis="0 0 1" limited="true" range="-0.1 0.05"/>
                  <geom type="sphere" size="0.1" mass="1" contype="0" conaffinity="0"/></body>
                </worldbody></mujoco>"#
            )
        };
        let (light, heavy) = (plant(&text(1.0)), plant(&text(6.0)));
        let load = entry(Id::Payload, "a", &[5.0, 0.0, 0.0, 0.0]);
        let (mut one, mut other) = (simulation(&light, &[load]), simulation(&heavy, &[]));
        for simulation in [&mut one, &mut other] {
            let start = simulation.qpos().to_vec();
            simulation.set_motion(0.0, &start, &[0.5, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0]);
            for _ in 0..500 {
                simulation.step();
            }
        }
        // The regularisation of contacts is of the compiled mass, so not to rounding.
        assert_close(&one.qpos()[..3], &other.qpos()[..3], 2e-3, option);
        assert!(
            !one.diverged() && one.qpos()[2] > 0.09,
            "{option} {:?}",
            one.qpos()
        );
        assert!(
            one.qvel()[0].abs() < 1e-2,
            "friction stops it: {option} {:?}",
            one.qvel()
        );
    }
}

#[test]
fn stiff_drag_on_a_light_body_decays() {
    let text =
        hull(r#"gravity="0 0 0" timestep="0.01""#, "").replace("mass=\"2\"", "mass=\"0.01\"");
    let plant = plant(&text);
    let drag = entry(Id::LinearDrag, "hull", &[500.0; 6]);
    let mut simulation = simulation(&plant, &[drag]);
    simulation.set_motion(
        0.0,
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        &[1.0, -1.0, 1.0, 1.0, 1.0, 1.0],
    );
    for _ in 0..10 {
        simulation.step();
    }
    assert!(!simulation.diverged());
    assert!(
        simulation.qvel().iter().all(|v| v.abs() < 1e-3),
        "{:?}",
        simulation.qvel()
    );
}

#[test]
fn current_is_the_wind_of_a_native_fluid_and_relative_velocity_elsewhere() {
    let fluid = hull(r#"gravity="0 0 0" density="1000" viscosity="0.1""#, "");
    let (still, windy) = (
        plant(&fluid),
        plant(&fluid.replace("density=", r#"wind="0.3 -0.1 0.2" density="#)),
    );
    let current = [entry(Id::Current, "hull", &[0.3, -0.1, 0.2])];
    let (mut one, mut other) = (simulation(&still, &current), simulation(&windy, &[]));
    for _ in 0..500 {
        one.step();
        other.step();
    }
    assert_eq!(one.qpos(), other.qpos());
    // Without a fluid of its own, through drag alone: the body ends in the water's velocity.
    let dry = plant(&hull(r#"gravity="0 0 0""#, ""));
    let effects = [
        entry(Id::Current, "hull", &[0.3, -0.1, 0.2]),
        entry(Id::LinearDrag, "hull", &[50.0; 6]),
    ];
    let mut drifting = simulation(&dry, &effects);
    for _ in 0..2000 {
        drifting.step();
    }
    assert_close(&drifting.qvel()[..3], &[0.3, -0.1, 0.2], 1e-6, "drift");
}

/// The waves of the nominal's instance push its bodies once, as in a simulation of the nominal alone.
#[test]
fn a_hypothesis_moves_in_the_waves_of_its_nominal() {
    for effect in [
        r#"{"effect": "hydrostatics", "target": "hull", "parameters": {}}"#,
        r#"{"effect": "net_buoyancy", "target": "hull", "parameters": {"force": 19.62}}"#,
    ] {
        let water = format!(
            r#"<extension><plugin plugin="hydro.wrench"><instance name="water"><config key="waterline" value="1"/>
            <config key="waves" value='{{"schema": "hydro-waves/1", "components": [{{"height": 0.4, "period": 10}}]}}'/>
            <config key="effects" value='{{"schema": "hydro-effects/1", "effects": [{effect}]}}'/></instance></plugin>
            </extension><worldbody>"#
        );
        let carried = r#"<plugin plugin="hydro.wrench" instance="water"/>"#;
        let text = hull("", carried).replace("<worldbody>", &water);
        let plant = plant(&text);
        let mut nominal = Data::new(&Arc::new(Model::from_xml(&text).unwrap())).unwrap();
        let nothing = entry(Id::LinearDrag, "hull", &[0.0; 6]);
        let mut supposed = simulation(&plant, &[nothing]);
        for _ in 0..100 {
            nominal.step();
            supposed.step();
        }
        assert!(nominal.qvel()[0].abs() > 1e-3, "the waves push");
        assert_close(supposed.qvel(), nominal.qvel(), 1e-12, effect);
    }
}

#[test]
fn nuisances_change_what_they_say() {
    let text = r#"<mujoco><option density="1000" viscosity="0.01"/><worldbody>
        <body name="hull" gravcomp="1.1"><freejoint/>
          <geom type="ellipsoid" size="0.3 0.2 0.1" mass="10" fluidshape="ellipsoid"/>
          <body name="arm" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" damping="0.5"/>
            <geom type="sphere" size="0.05" pos="0.1 0 0" mass="1"/></body>
        </body></worldbody>
        <actuator><position name="elbow" joint="elbow" kp="5"/></actuator></mujoco>"#;
    let plant = plant(text);
    let known = plant.description().nuisances.clone();
    let names: Vec<&str> = known
        .iter()
        .map(|nuisance| nuisance.name.as_str())
        .collect();
    for wanted in [
        "hull.mass",
        "hull.inertia.x",
        "hull.com.z",
        "arm.mass",
        "fluid.blunt_drag",
        "fluid.kutta_lift",
        "elbow.gain",
        "elbow.damping",
    ] {
        assert!(names.contains(&wanted), "{names:?}");
    }
    let turned = |name: &str, value: f64| {
        let mut nuisances = vec![0.0; known.len()];
        nuisances[names.iter().position(|known| *known == name).unwrap()] = value;
        let mut simulation = plant.simulation(&nuisances, &[]).unwrap();
        simulation.step();
        simulation.qvel().to_vec()
    };
    let nominal = {
        let mut simulation = simulation(&plant, &[]);
        simulation.step();
        simulation.qvel().to_vec()
    };
    // 1.1 * 10 kg lift 11 kg in all, at the hull's origin; a tenth more mass falls by that, not more.
    assert!(nominal[2].abs() < 0.02, "{nominal:?}");
    let heavier = turned("hull.mass", 0.5);
    assert!(heavier[2] < -0.001, "{heavier:?}");
    // The centre of mass to the front, buoyancy where it was: it pitches down by the whole weight.
    let moved = turned("hull.com.x", 0.05);
    assert!((moved[4] - nominal[4]) > 1e-4, "{moved:?} {nominal:?}");
    assert_ne!(
        turned("elbow.gain", 0.5),
        nominal.clone().iter().map(|v| v + 1.0).collect::<Vec<_>>()
    );
    assert!(
        known
            .iter()
            .any(|nuisance| nuisance.class == NuisanceClass::Damping)
    );
}

/// A ramp that acts a step early is the ramp a step further on.
#[test]
fn commands_may_act_early() {
    let text = r#"<mujoco><worldbody><body><joint name="rail" type="slide"/><geom size="0.1" mass="1"/></body>
        </worldbody><actuator><motor name="push" joint="rail"/></actuator></mujoco>"#;
    let plant = plant(text);
    let nuisances = &plant.description().nuisances;
    let lead = nuisances
        .iter()
        .position(|nuisance| nuisance.quantity == Quantity::CommandLead);
    let speed = |early: f64, ahead: usize| {
        let mut values = vec![0.0; nuisances.len()];
        values[lead.unwrap()] = early;
        let mut simulation = plant.simulation(&values, &[]).unwrap();
        for step in 0..20 {
            let place = if step == 0 { 0 } else { step + ahead };
            simulation.set_control(&[0.1 * place as f64]);
            simulation.step();
        }
        simulation.qvel()[0]
    };
    assert!((speed(1.0, 0) - speed(0.0, 1)).abs() < 1e-12);
    assert!(speed(0.5, 0) > speed(0.0, 0));
}

/// Between two commands a force is that of the command held: what a further step under it would show first.
#[test]
fn a_look_shows_forces_under_the_command_that_is_held() {
    let text = r#"<mujoco><worldbody><body><site name="cell"/><geom size="0.1" mass="1" contype="0"/><body>
        <joint name="rail" type="slide"/><geom size="0.1" mass="1" contype="0"/></body></body></worldbody>
        <actuator><position name="servo" joint="rail" kp="50"/></actuator>
        <sensor><force name="force" site="cell"/><jointpos name="place" joint="rail"/></sensor></mujoco>"#;
    let plant = plant(text);
    let nuisances = vec![0.0; plant.description().nuisances.len()];
    let mut simulation = plant.simulation(&nuisances, &[]).unwrap();
    let stepped = |simulation: &mut dyn Simulation, command: f64| {
        simulation.set_control(&[command]);
        simulation.step();
        simulation.sensors().to_vec()
    };
    stepped(simulation.as_mut(), 0.1);
    simulation.look();
    let held = simulation.sensors().to_vec();
    let here = simulation.save();
    assert_eq!(held, stepped(simulation.as_mut(), 0.1));
    simulation.load(&here);
    let jumped = stepped(simulation.as_mut(), 0.2);
    assert_eq!(held[3], jumped[3]);
    assert!((held[2] - jumped[2]).abs() > 1.0, "{held:?} {jumped:?}");
}

/// Derivatives by a nuisance parameter over half a second agree between Runge-Kutta and the cheaper integrator to a per cent.
#[test]
fn the_cheaper_plant_has_the_same_derivatives() {
    let text = |integrator: &str| {
        format!(
            r#"<mujoco><option timestep="0.002" integrator="{integrator}"/><worldbody><body>
            <joint name="hinge" damping="0.1" axis="0 1 0"/><geom name="rod" type="capsule" size="0.02"
            fromto="0 0 0 0.4 0 0" mass="1"/></body></worldbody><actuator><position name="servo" joint="hinge"
            kp="20" kv="2"/></actuator></mujoco>"#
        )
    };
    let exact = plant(&text("RK4"));
    let cheaper = exact.cheaper().unwrap();
    assert_eq!(cheaper.description(), exact.description());
    let after = |plant: &dyn Plant, mass: f64| {
        let known = &plant.description().nuisances;
        let of = known
            .iter()
            .position(|nuisance| nuisance.quantity == Quantity::Mass);
        let mut nuisances = vec![0.0; known.len()];
        nuisances[of.unwrap()] = mass;
        let mut simulation = plant.simulation(&nuisances, &[]).unwrap();
        simulation.set_control(&[0.5]);
        (0..250).for_each(|_| simulation.step());
        simulation.qpos()[0]
    };
    let slope = |plant: &dyn Plant| (after(plant, 0.003) - after(plant, 0.0)) / 0.003;
    assert!((slope(cheaper) / slope(&exact) - 1.0).abs() < 0.01);
    assert!(after(cheaper, 0.0) != after(&exact, 0.0));
    assert!(plant(&text("Euler")).cheaper().is_none());
}

#[test]
fn the_description_says_what_is_there() {
    let plant = plant(&leg("", ""));
    let description = plant.description();
    assert_eq!((description.nq, description.nv), (9, 8));
    assert_eq!(description.state_len, 18);
    let bodies: Vec<(&str, bool)> = description
        .bodies
        .iter()
        .map(|body| (body.name.as_str(), body.root))
        .collect();
    assert_eq!(bodies, [("base", true), ("thigh", false), ("calf", false)]);
    assert!((description.bodies[0].scale.mass - 4.4).abs() < 1e-9);
    let kinds: Vec<SensorKind> = description.sensors.iter().map(|s| s.kind).collect();
    use SensorKind::{Acceleration, Force, JointPosition, Torque};
    assert_eq!(kinds, [Force, Torque, JointPosition, Acceleration]);
    assert_eq!(description.sensors[2].joint.as_deref(), Some("hip"));
    assert_eq!(description.joints[0].qpos, 7);
}

/// What a log does not say: times within a step, those of forces where there are any, and what came before it.
#[test]
fn what_a_log_does_not_say_is_uncertain() {
    let of = |text: &str| -> Vec<String> {
        let plant = plant(text);
        let all = plant.description().nuisances.iter();
        let of_log = all.filter(|of| of.quantity.is_of_log());
        of_log.map(|of| of.name.clone()).collect()
    };
    let whole = hull("", "");
    let motion = [
        "commands.lead",
        "commands.before",
        "positions.lag",
        "velocities.lag",
    ];
    let forces = ["forces.lead", "forces.lag"];
    assert_eq!(
        of(&whole),
        [
            motion[0], forces[0], motion[1], motion[2], motion[3], forces[1]
        ]
    );
    let accelerometer = r#"<accelerometer name="acceleration" site="imu" noise="0.02"/>"#;
    assert_eq!(of(&whole.replace(accelerometer, "")), motion);
}

#[test]
fn the_description_says_the_medium() {
    let medium = |option: &str, attributes: &str| {
        let body = format!("<body name=\"hull\" {attributes}");
        let text = hull(option, "").replace("<body name=\"hull\"", &body);
        plant(&text).description().medium
    };
    assert_eq!(medium("", ""), Medium::None);
    assert_eq!(medium("density=\"1.2\"", ""), Medium::Air);
    assert_eq!(medium("density=\"1000\"", ""), Medium::Water);
    assert_eq!(medium("", "gravcomp=\"1\""), Medium::Water);
    // An arm whose weight its drives carry does not float.
    let arm = r#"<mujoco><worldbody><body name="arm" gravcomp="1"><joint name="hip" axis="0 1 0"/>
        <geom size="0.1" mass="1"/></body></worldbody></mujoco>"#;
    assert_eq!(plant(arm).description().medium, Medium::None);
}

/// Only what stands still and is no drawing; distances are to what is nearest of it.
#[test]
fn the_description_says_which_walls_stand() {
    let around = r#"<geom type="plane" size="9 9 .1" pos="0 0 -6"/>
        <geom type="box" size="1 2 3" pos="5 0 0" euler="0 0 90"/>
        <geom type="plane" size="9 9 .1" rgba="0 0 1 .3" contype="0" conaffinity="0"/>"#;
    let text = leg("", "").replace("<worldbody>", &format!("<worldbody>{around}"));
    let plant = plant(&text);
    let walls = &plant.description().walls;
    let distances: Vec<f64> = walls.iter().map(|w| w.distance([0.0, 3.0, 1.0])).collect();
    // The box has been turned: 2 m along x.
    let beyond = (3.0_f64.powi(2) + 2.0_f64.powi(2)).sqrt();
    assert_close(&distances, &[7.0, beyond], 1e-9, "distances");
    assert_eq!(walls[0].distance([0.0, 0.0, -7.0]), 0.0);
    assert_eq!(walls[1].distance([6.9, 0.9, 2.9]), 0.0);
}

#[test]
fn threads_change_nothing_and_a_saved_simulation_goes_on_as_it_would_have() {
    let plant = plant(&leg("", ""));
    let effects = [
        entry(Id::AddedMass, "calf", &[1.0, 2.0, 0.5, 0.01, 0.01, 0.01]),
        entry(Id::QuadraticDrag, "calf", &[3.0; 6]),
        entry(Id::WakeMemory, "base", &wake(&plant, "base")),
    ];
    let run = |seed: usize| {
        let mut simulation = simulation(&plant, &effects);
        simulation.set_control(&[0.1 * seed as f64, 0.2]);
        for _ in 0..200 {
            simulation.step();
        }
        simulation.save()
    };
    let alone: Vec<Vec<f64>> = (0..8).map(run).collect();
    let together: Vec<Vec<f64>> = (0..8).into_par_iter().map(run).collect();
    assert_eq!(alone, together);
    let mut simulation = simulation(&plant, &effects);
    simulation.load(&alone[3]);
    let mut other = simulation_from(&plant, &effects, 3);
    for _ in 0..50 {
        simulation.step();
        other.step();
    }
    assert_eq!(simulation.save(), other.save());
}

fn simulation_from(plant: &MujocoPlant, effects: &[Entry], seed: usize) -> Box<dyn Simulation> {
    let mut simulation = simulation(plant, effects);
    simulation.set_control(&[0.1 * seed as f64, 0.2]);
    for _ in 0..200 {
        simulation.step();
    }
    simulation
}

/// Values of a wake: the middle of what its prior allows.
fn wake(plant: &MujocoPlant, body: &str) -> Vec<f64> {
    values(plant, Id::WakeMemory, body)
}

/// Values of an effect on a body that make it felt.
fn values(plant: &MujocoPlant, id: Id, body: &str) -> Vec<f64> {
    use hydro_effects::Target;
    use hydro_effects::effect;
    let body = plant
        .description()
        .bodies
        .iter()
        .find(|known| known.name == body)
        .unwrap();
    effect(id)
        .parameters(&Target::Body(body.scale.clone()))
        .iter()
        .map(|p| (p.start + 0.5 * p.prior_sd).clamp(p.lower, p.upper))
        .collect()
}

#[test]
fn refusals_say_what_is_there() {
    let plant = plant(&leg("", ""));
    let nuisances = vec![0.0; plant.description().nuisances.len()];
    let refusal = |effect: Entry| match plant.simulation(&nuisances, &[effect]) {
        Ok(_) => panic!("not refused"),
        Err(fault) => fault.to_string(),
    };
    let text = refusal(entry(Id::AddedMass, "foot", &[0.0; 6]));
    assert!(
        text.contains("`foot`") && text.contains("base, thigh, calf"),
        "{text}"
    );
    let text = refusal(entry(Id::AddedMass, "calf", &[0.0; 2]));
    assert!(
        text.contains("2 values") && text.contains("surge [kg]"),
        "{text}"
    );
    let text = refusal(entry(Id::JointDamping, "ankle", &[0.0]));
    assert!(text.contains("hip, knee"), "{text}");
    let text = match plant.simulation(&nuisances[1..], &[]) {
        Ok(_) => panic!("not refused"),
        Err(fault) => fault.to_string(),
    };
    assert!(text.contains("values of nuisance parameters"), "{text}");
    let missing = MujocoPlant::load(&PathBuf::from("/no/such.xml")).unwrap_err();
    assert!(missing.to_string().contains("/no/such.xml"), "{missing}");
}

#[test]
fn a_simulation_that_blows_up_says_so_and_starts_again() {
    let plant = plant(&hull(r#"gravity="0 0 0""#, ""));
    let mut simulation = simulation(&plant, &[]);
    simulation.set_control(&[1e9]);
    for _ in 0..50 {
        simulation.step();
    }
    assert!(simulation.diverged());
    simulation.reset();
    simulation.step();
    assert!(!simulation.diverged());
    simulation.restart(&[f64::NAN; 14]);
    assert!(simulation.diverged());
}

#[test]
fn forward_twice_is_forward_once() {
    // Through the attribute, where `mj_forward` can be called as often as one likes.
    let effects = r#"{"schema": "hydro-effects/1", "effects": [
        {"effect": "added_mass", "target": "hull", "parameters": {"surge": 10, "sway": 4, "heave": 7, "roll": 0.1, "pitch": 0.2, "yaw": 0.3}},
        {"effect": "linear_drag", "target": "hull", "parameters": {"surge": 10, "sway": 4, "heave": 7, "roll": 0.1, "pitch": 0.2, "yaw": 0.3}}]}"#;
    let text = patched(&hull(r#"gravity="0 0 -9""#, "<body/>"), effects);
    let model = Arc::new(Model::load(&scene(&text).path).unwrap());
    let mut data = Data::new(&model).unwrap();
    data.qvel_mut()
        .copy_from_slice(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
    data.forward();
    let once = data.qacc().to_vec();
    data.forward();
    assert_close(data.qacc(), &once, 1e-13, "again");
}

/// A scene with effects in an instance on the hull.
fn patched(text: &str, effects: &str) -> String {
    let config = format!(
        r#"<extension><plugin plugin="hydro.wrench"><instance name="water">
           <config key="effects" value='{effects}'/></instance></plugin></extension><worldbody>"#
    );
    text.replacen("<worldbody>", &config, 1).replacen(
        "<freejoint/>",
        r#"<freejoint/><plugin plugin="hydro.wrench" instance="water"/>"#,
        1,
    )
}

/// The fit's simulation and the patched file agree, over two seconds.
#[test]
fn a_fitted_effect_written_to_a_file_acts_as_it_did() {
    let option = r#"gravity="0 0 -9.81" timestep="0.002""#;
    let text = leg("", option);
    let fitted = plant(&text);
    let chosen = [
        (Id::AddedMass, "base"),
        (Id::LinearDrag, "base"),
        (Id::QuadraticDrag, "calf"),
        (Id::NetBuoyancy, "base"),
        (Id::WakeMemory, "base"),
        (Id::CrossFlowDrag, "thigh"),
        (Id::BassetHistory, "base"),
        (Id::Waves, "base"),
        (Id::Current, "base"),
    ];
    let mut effects: Vec<Entry> = chosen
        .iter()
        .map(|(id, body)| entry(*id, body, &values(&fitted, *id, body)))
        .collect();
    effects.push(entry(Id::ActuatorDeadband, "hip", &[0.05]));
    let mut one = simulation(&fitted, &effects);
    let listed: Vec<String> = effects.iter().map(|entry| json(&fitted, entry)).collect();
    let list = format!(
        r#"{{"schema": "hydro-effects/1", "effects": [{}]}}"#,
        listed.join(", ")
    );
    let text = patched(&text, &list).replace(
        r#"<force name="force" site="ankle"/><torque name="torque" site="ankle"/>"#,
        r#"<plugin name="force" plugin="hydro.load_cell"><config key="site" value="ankle"/></plugin>
           <plugin name="torque" plugin="hydro.load_cell"><config key="site" value="ankle"/>
           <config key="quantity" value="torque"/></plugin>"#,
    );
    let text = text.replace(
        "</extension>",
        r#"<plugin plugin="hydro.load_cell"/></extension>"#,
    );
    let mut other = simulation(&plant(&text), &[]);
    let mut moved = 0.0_f64;
    for step in 0..1000 {
        let command = [0.5 * (0.02 * f64::from(step)).sin(), 0.1];
        for simulation in [&mut one, &mut other] {
            simulation.set_control(&command);
            simulation.step();
        }
        let largest = one
            .sensors()
            .iter()
            .fold(1.0_f64, |most, x| most.max(x.abs()));
        assert_close(one.sensors(), other.sensors(), 1e-11 * largest, "sensors");
        moved = moved.max(one.qvel()[3].abs());
    }
    assert_close(one.qpos(), other.qpos(), 1e-12, "qpos");
    assert_close(one.qvel(), other.qvel(), 1e-12, "qvel");
    assert!(moved > 1e-3 && !one.diverged());
}

/// An entry as an `effects.json` has it.
fn json(plant: &MujocoPlant, entry: &Entry) -> String {
    use hydro_effects::Target;
    use hydro_effects::{card::ActuatorScale, effect};
    let body = plant
        .description()
        .bodies
        .iter()
        .find(|known| known.name == entry.target);
    let target = body.map_or(
        Target::Actuator(ActuatorScale {
            command: 1.0,
            inflow: 0.0,
            step: 0.002,
            thrusts: true,
        }),
        |body| Target::Body(body.scale.clone()),
    );
    let values: Vec<String> = effect(entry.effect)
        .parameters(&target)
        .iter()
        .zip(&entry.parameters)
        .map(|(parameter, value)| format!(r#""{}": {value:?}"#, parameter.name))
        .collect();
    format!(
        r#"{{"effect": "{}", "target": "{}", "parameters": {{{}}}}}"#,
        entry.effect,
        entry.target,
        values.join(", ")
    )
}

/// A force sensor of MuJoCo's reads what a payload, as a body, would make it read.
#[test]
fn force_sensors_show_what_was_added() {
    let body = r#"<body pos="0.02 0.05 -0.25"><inertial pos="0 0 0" mass="2" diaginertia="1e-14 1e-14 1e-14"/></body>"#;
    for option in ["", r#"integrator="RK4""#] {
        let (light, heavy) = (plant(&leg("", option)), plant(&leg(body, option)));
        let load = entry(Id::Payload, "calf", &[2.0, 0.02, 0.05, -0.25]);
        let (mut one, mut other) = (simulation(&light, &[load]), simulation(&heavy, &[]));
        for simulation in [&mut one, &mut other] {
            simulation.set_control(&[2.0, 1.0]);
            (0..20).for_each(|_| simulation.step());
        }
        assert!(one.sensors()[..6].iter().any(|value| value.abs() > 0.1));
        assert_close(&one.sensors()[..6], &other.sensors()[..6], 1e-9, option);
    }
}

/// Not a test of right or wrong: what a step and a simulation cost. Run by hand, in release.
#[test]
#[ignore = "a measurement"]
#[expect(clippy::print_stderr, reason = "a measurement is read")]
fn what_it_costs() {
    let timed = |count: u32, mut call: Box<dyn FnMut()>| {
        let start = std::time::Instant::now();
        (0..count).for_each(|_| call());
        start.elapsed().as_secs_f64() / f64::from(count) * 1e6
    };
    let still = plant(&hull(r#"gravity="0 0 0""#, ""));
    for (name, effects) in [
        ("none", vec![]),
        ("added_mass", vec![entry(Id::AddedMass, "hull", &[1.0; 6])]),
        (
            "linear_drag",
            vec![entry(Id::LinearDrag, "hull", &[1.0; 6])],
        ),
    ] {
        let mut simulation = simulation(&still, &effects);
        let step = timed(200_000, Box::new(move || simulation.step()));
        eprintln!("{name}: {step:.2} us a step");
    }
    let mut nuisances = vec![0.0; still.description().nuisances.len()];
    let effects = [entry(Id::AddedMass, "hull", &[1.0; 6])];
    let plain = {
        let (still, nuisances, effects) = (&still, nuisances.clone(), effects.clone());
        let start = std::time::Instant::now();
        for _ in 0..1000 {
            drop(still.simulation(&nuisances, &effects).unwrap());
        }
        start.elapsed().as_secs_f64() * 1e3
    };
    let start = std::time::Instant::now();
    for turn in 0..1000 {
        nuisances[0] = 1e-4 * f64::from(turn);
        drop(still.simulation(&nuisances, &effects).unwrap());
    }
    let turned = start.elapsed().as_secs_f64() * 1e3;
    eprintln!("simulation(): {plain:.1} us, with a mass nuisance parameter {turned:.1} us");
}

/// Play is a joint in series: the body lags behind the motor by half of it on either side.
#[test]
fn play_is_a_memory_of_the_bodys_motion() {
    let text = r#"<mujoco><option gravity="0 0 -9.81" timestep="0.001"/><worldbody>
        <body name="arm"><joint name="elbow" axis="0 1 0" damping="0.2" armature="0.05"/>
          <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="1"/></body></worldbody>
        <actuator><position name="servo" joint="elbow" kp="50"/></actuator>
        <sensor><jointpos name="elbow" joint="elbow"/><framezaxis name="z" objtype="body" objname="arm"/></sensor>
        </mujoco>"#;
    // The file is read again for a model with play.
    let kept = scene(text);
    let (nominal, played) = (
        MujocoPlant::load(&kept.path).unwrap(),
        plant(&text.replace(
            "<geom",
            r#"<joint name="elbow_play" axis="0 1 0" limited="true" range="-2.864788975654116 2.864788975654116"
               armature="ARMATURE" solreflimit="0.002 1" solimplimit="0.99 0.999 0.001"/><geom"#,
        )
        .replace("ARMATURE", &format!("{}", 1e-4 * plant(text).description().joints[0].scale.inertia))),
    );
    let backlash = [entry(Id::JointBacklash, "elbow", &[0.1])];
    let (mut one, mut other) = (simulation(&nominal, &backlash), simulation(&played, &[]));
    for step in 0..500 {
        for simulation in [&mut one, &mut other] {
            simulation.set_control(&[0.3 * (0.02 * f64::from(step)).sin()]);
            simulation.step();
        }
    }
    assert_eq!(one.qpos().len(), 1);
    assert_close(one.sensors(), other.sensors(), 1e-10, "readings");
    // The nominal's coordinate is that of the body.
    let body = other.qpos()[0] + other.qpos()[1];
    assert!((one.qpos()[0] - body).abs() < 1e-10);
    assert!(
        other.qpos()[1].abs() > 0.03,
        "it hangs in a stop: {:?}",
        other.qpos()
    );
    // Where the body is within the gap is memory: another state of the nominal leaves it, and it can be set.
    let (hung, full) = (one.memory(), one.full_state());
    assert_eq!((one.hidden(), hung.len()), (2, 2));
    assert!((hung[0] - other.qpos()[1]).abs() < 1e-10);
    let moved = [full[0], 0.4, -0.2];
    one.rejoin(&moved);
    assert_eq!((one.qpos()[0], one.memory()), (0.4, hung.clone()));
    one.set_memory(&[0.02, 0.0]);
    assert!((one.qpos()[0] - 0.4).abs() < 1e-12 && one.memory() == [0.02, 0.0]);
    // A force on the nominal's coordinate pushes the body, not its motor.
    one.rejoin(&full);
    one.set_memory(&[0.0, 0.0]);
    let (before, motor) = (one.qvel()[0], one.qvel()[0]);
    one.set_force(&[5.0]);
    one.step();
    let within = one.memory()[1];
    assert!(one.qvel()[0] > before && (one.qvel()[0] - within - motor).abs() < within);
    one.set_force(&[0.0]);
    // Starting again from a nominal state.
    let state = [0.0, 0.2, 0.0];
    one.restart(&state);
    assert_eq!((one.qpos(), one.diverged()), (&[0.2][..], false));
    assert_eq!(one.memory(), [0.0, 0.0]);
    one.retract(&[0.1, 0.5]);
    assert!((one.qpos()[0] - 0.3).abs() < 1e-12 && (one.qvel()[0] - 0.5).abs() < 1e-12);
}

/// A carriage without a hull tows the robot; what hangs on it does not make it bulky.
#[test]
fn a_towed_hull_is_bulkier_than_its_carriage() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("mjcf/gap/b1_tow.xml");
    let plant = MujocoPlant::load(&path).unwrap();
    let bulk = |name: &str| {
        let mut bodies = plant.description().bodies.iter();
        bodies.find(|body| body.name == name).unwrap().bulk
    };
    assert!(bulk("trunk") > 10.0 * bulk("gantry"));
    assert!(bulk("trunk") > 2.0 * bulk("FR_thigh"));
}

/// However heavy: what has no hull is not the bulky one where others have.
#[test]
fn a_heavy_carriage_without_a_hull_is_not_bulky() {
    let scene = |hull: &str| {
        format!(
            r#"<mujoco><option density="1000"/><worldbody>
              <body name="carriage"><joint type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="500" diaginertia="1 1 1"/>
                <body name="towed" pos="0 0 -1"><inertial pos="0 0 0" mass="30" diaginertia="1 1 1"/>{hull}</body>
              </body></worldbody></mujoco>"#
        )
    };
    let bulks = |hull: &str| {
        let plant = plant(&scene(hull));
        let bodies = &plant.description().bodies;
        let bulk = |name: &str| bodies.iter().find(|body| body.name == name).unwrap().bulk;
        (bulk("carriage"), bulk("towed"))
    };
    let (carriage, towed) =
        bulks(r#"<geom type="ellipsoid" size=".4 .2 .2" fluidshape="ellipsoid"/>"#);
    assert_eq!(carriage, 0.0);
    assert!(
        (towed - 4.0 / 3.0 * std::f64::consts::PI * 0.016).abs() < 1e-9,
        "{towed}"
    );
    // Without any hull masses tell.
    let (carriage, towed) = bulks("");
    assert!(carriage > 10.0 * towed && towed > 0.0);
}
