//! Prescribed motion in MuJoCo: the forces that it takes, by hand, and a table of steady states from end to end.
#![cfg(mujoco_plugins)]

use std::{fs, sync::Arc, sync::atomic::AtomicBool};

use hydro_effects::{Entry, Id, Medium};
use hydro_gap::{
    GapError, Options, Problem, Settings, Uncertainty, VerifyInput, Watch,
    plant::{
        Plant, Simulation,
        prescribed::{Course, PrescribedJoint, PrescribedMotion, Spline},
    },
    trial::{SensorQuantity, SensorSignature, Signature, Trial, list, read_listed},
    verdict::Outcome,
};
use hydro_plugin::mujoco::plant::MujocoPlant;
use tempfile::TempDir;

/// Mass of the hull [kg].
const MASS: f64 = 5.0;
const GRAVITY: f64 = 9.81;

fn plant(text: &str) -> (TempDir, MujocoPlant) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    fs::write(&path, text).unwrap();
    let plant = MujocoPlant::load(&path).unwrap();
    (folder, plant)
}

/// A hull on a carriage that slides along x; a load cell between them.
fn towed(integrator: &str) -> (TempDir, MujocoPlant) {
    plant(&format!(
        r#"<mujoco><option timestep="0.01" integrator="{integrator}"/>
        <worldbody><body name="carriage"><joint name="tow" type="slide" axis="1 0 0"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
          <body name="hull"><geom type="box" size="0.5 0.1 0.1" mass="{MASS}"/><site name="cell"/></body>
        </body></worldbody>
        <sensor><force name="force" site="cell"/><torque name="torque" site="cell"/></sensor></mujoco>"#
    ))
}

fn simulation(plant: &MujocoPlant, effects: &[Entry]) -> Box<dyn Simulation> {
    let nuisances = vec![0.0; plant.description().nuisances.len()];
    plant.simulation(&nuisances, effects).unwrap()
}

fn along(course: Course) -> Arc<PrescribedMotion> {
    Arc::new(PrescribedMotion {
        joints: vec![PrescribedJoint {
            name: "tow".to_owned(),
            qpos: 0,
            dof: 0,
            course,
        }],
        holds_the_rest: false,
    })
}

/// A swing of 0.3 m at 2 rad/s.
fn swing() -> Spline {
    let times: Vec<f64> = (0..=200).map(|row| 0.02 * f64::from(row) - 0.5).collect();
    let values: Vec<f64> = times.iter().map(|time| 0.3 * (2.0 * time).sin()).collect();
    Spline::through(&times, &values).unwrap()
}

fn on_hull(effect: Id, parameters: Vec<f64>) -> Entry {
    Entry {
        effect,
        target: "hull".to_owned(),
        parameters,
    }
}

const INTEGRATORS: [&str; 4] = ["Euler", "implicit", "implicitfast", "RK4"];

/// Reading ahead of the towed hull below: mass, added mass and drag. Drag is implicit: it resists the speed that the step of
/// 0.01 s ends with, but for Runge-Kutta.
fn shown(v: f64, a: f64, integrator: &str) -> f64 {
    let step = if integrator == "RK4" { 0.0 } else { 0.01 };
    (MASS + 2.0) * a + 7.0 * v + 30.0 * v.abs() * v + step * (7.0 + 60.0 * v.abs()) * a
}

/// MuJoCo's force sensor shows what the parent exerts on the child: upwards the weight, along the tow what keeps up the motion
/// against the water.
#[test]
fn the_load_cell_of_a_towed_body_shows_mass_times_acceleration_and_drag() {
    let effects = [
        on_hull(Id::LinearDrag, vec![7.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        on_hull(Id::QuadraticDrag, vec![30.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        on_hull(Id::AddedMass, vec![2.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ];
    for integrator in INTEGRATORS {
        let (_folder, plant) = towed(integrator);
        let mut simulation = simulation(&plant, &effects);
        let spline = swing();
        simulation.prescribe(Some(along(Course::Spline(spline.clone()))));
        simulation.set_motion(0.0, &[9.0], &[9.0]);
        for step in 0..300 {
            let time = 0.01 * f64::from(step);
            let [position, v, a] = spline.at(time);
            assert!(
                (simulation.qpos()[0] - position).abs() < 1e-9,
                "{integrator} {step}"
            );
            assert!(
                (simulation.qvel()[0] - v).abs() < 1e-9,
                "{integrator} {step}"
            );
            simulation.step();
            let expected = shown(v, a, integrator);
            let found = simulation.sensors();
            assert!(
                (found[0] - expected).abs() < 1e-6,
                "{integrator} {step} {found:?} {expected}"
            );
            assert!(
                (found[2] - MASS * GRAVITY).abs() < 1e-6,
                "{integrator} {found:?}"
            );
        }
        simulation.look();
        let [_, v, a] = spline.at(3.0);
        let expected = shown(v, a, integrator);
        assert!(
            (simulation.sensors()[0] - expected).abs() < 1e-6,
            "{integrator}"
        );
        // Let go, it moves as it likes.
        simulation.prescribe(None);
        simulation.step();
        assert!(simulation.sensors()[0].abs() > 0.0);
        assert!((simulation.qpos()[0] - spline.at(3.01)[0]).abs() > 1e-9);
    }
}

/// A steady state shows what a tow at that speed does.
#[test]
fn a_steady_state_is_a_tow_at_constant_speed() {
    let effects = [on_hull(
        Id::QuadraticDrag,
        vec![30.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    )];
    let (_folder, plant) = towed("implicitfast");
    let mut simulation = simulation(&plant, &effects);
    let line: Vec<f64> = (0..5).map(f64::from).collect();
    let values: Vec<f64> = line.iter().map(|time| 0.8 * time).collect();
    let spline = Course::Spline(Spline::through(&line, &values).unwrap());
    let steady = Course::Steady {
        times: vec![1.0, 2.0],
        states: vec![[3.0, -0.4], [0.0, 0.8]],
    };
    let mut read = |course: Course, time: f64| {
        simulation.prescribe(Some(along(course)));
        simulation.set_motion(time, &[0.0], &[0.0]);
        simulation.step();
        simulation.sensors()[..3].to_vec()
    };
    let [one, other] = [spline, steady.clone()].map(|course| read(course, 2.0));
    for (one, other) in one.iter().zip(&other) {
        assert!((one - other).abs() < 1e-9, "{one} {other}");
    }
    assert!((one[0] - 30.0 * 0.64).abs() < 1e-9, "{one:?}");
    assert!((read(steady, 1.0)[0] + 30.0 * 0.16).abs() < 1e-9);
}

/// What nobody modelled moves nothing that is prescribed, and shows in the load cell.
#[test]
fn an_unmodelled_force_on_a_prescribed_joint_is_felt_and_moves_nothing() {
    let (_folder, plant) = towed("Euler");
    let mut simulation = simulation(&plant, &[]);
    let spline = swing();
    simulation.prescribe(Some(along(Course::Spline(spline.clone()))));
    simulation.set_motion(0.0, &[0.0], &[0.0]);
    simulation.set_force(&[4.0]);
    for step in 0..50 {
        let [position, _, a] = spline.at(0.01 * f64::from(step));
        assert!((simulation.qpos()[0] - position).abs() < 1e-9);
        simulation.step();
        assert!((simulation.sensors()[0] - (MASS * a - 4.0)).abs() < 1e-6);
    }
}

/// A pendulum of 2 m under a carriage feels the carriage's acceleration, and the carriage not the pendulum.
#[test]
fn what_hangs_on_a_prescribed_joint_feels_its_acceleration() {
    let (_folder, plant) = plant(
        r#"<mujoco><option timestep="0.001"/><worldbody><body name="carriage">
          <joint name="tow" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
          <body name="bob"><joint name="swing" axis="0 1 0"/><inertial pos="0 0 -2" mass="3" diaginertia="1e-9 1e-9 1e-9"/></body>
        </body></worldbody>
        <sensor><jointpos name="angle" joint="swing"/></sensor></mujoco>"#,
    );
    let mut simulation = simulation(&plant, &[]);
    let times: Vec<f64> = (0..6).map(|row| 0.1 * f64::from(row)).collect();
    let values: Vec<f64> = times.iter().map(|time| 0.5 * 1.5 * time * time).collect();
    let spline = Spline::through(&times, &values).unwrap();
    simulation.prescribe(Some(along(Course::Spline(spline))));
    simulation.set_motion(0.0, &[0.0, 0.2], &[0.0, 0.0]);
    simulation.step();
    // About +y the bob at -z swings towards -x for a positive angle: 2 q'' = a cos q - g sin q.
    let expected = 0.001 * (1.5 * 0.2_f64.cos() - GRAVITY * 0.2_f64.sin()) / 2.0;
    assert!(
        (simulation.qvel()[1] - expected).abs() < 1e-9,
        "{:?}",
        simulation.qvel()
    );
    assert!((simulation.qvel()[0] - 0.0015).abs() < 1e-9);
}

fn settings() -> Settings {
    Settings {
        medium: Some(Medium::Water),
        uncertainty: Uncertainty::default(),
        seed: 0,
        own_effects: Vec::new(),
        options: Options::default(),
    }
}

fn trials(plant: &MujocoPlant, table: &str) -> Vec<Trial> {
    let model = plant.description();
    let signature = Signature {
        actuators: Vec::new(),
        sensors: (model.sensors.iter())
            .map(|sensor| SensorSignature {
                name: sensor.name.clone(),
                dim: sensor.len,
                kind: SensorQuantity::Other,
            })
            .collect(),
        joints: model
            .joints
            .iter()
            .map(|joint| joint.name.clone())
            .collect(),
        state_len: model.state_len,
        timestep: model.timestep,
    };
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("steady.csv"), table).unwrap();
    let listed = list(folder.path()).unwrap();
    (listed.iter())
        .map(|one| read_listed(one, &signature).unwrap().0)
        .collect()
}

/// Towing tests of a hull whose drag is `quadratic` [N s^2/m^2] (linear 4 N s/m), with errors of 0.05 N that repeat no pattern.
fn tows(quadratic: f64, deviations: bool) -> String {
    let mut table =
        "tow_vel,force[0]".to_owned() + if deviations { ",force[0]_sd\n" } else { "\n" };
    for row in -12..=12_i32 {
        let v = 0.1 * f64::from(row);
        let error = 0.05 * (f64::from(row * row * 7 + row * 3) * 1.7).sin() * 1.4;
        let force = quadratic * v.abs() * v + error;
        table += &format!("{v},{force}");
        table += if deviations { ",0.05\n" } else { "\n" };
    }
    table
}

/// All degrees of freedom prescribed: found, named, added, and verified on rows that were left out.
#[test]
fn a_table_of_steady_states_is_named_and_verified() {
    let (_folder, plant) = towed("Euler");
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    for deviations in [true, false] {
        let mut all = trials(&plant, &tows(30.0, deviations));
        assert_eq!(all.len(), 10);
        let held_out = all.split_off(7);
        let problem = Problem::prepare(&plant, all.clone(), settings(), &watch).unwrap();
        let followed = hydro_gap::Followed::new(&problem, &watch).unwrap();
        let found = hydro_gap::locate(&followed, &[], &watch).unwrap();
        assert!(found.p_value < 0.01);
        let explanation = hydro_gap::explain(&followed, &watch).unwrap();
        let naming = hydro_gap::name(&explanation, &watch).unwrap();
        let chosen: Vec<Id> = naming.named.chosen.iter().map(|of| of.effect).collect();
        assert_eq!(
            naming.named.outcome,
            Outcome::Named,
            "{:?}",
            naming.named.ranking
        );
        assert_eq!(chosen, [Id::QuadraticDrag], "{deviations}");
        let surge = &naming.named.chosen[0].parameters[0];
        assert!((surge.value - 30.0).abs() < 1.0, "{surge:?}");
        let addition = hydro_gap::add(&explanation, &naming).unwrap();
        let verified = hydro_gap::verify(
            &VerifyInput {
                before: &plant,
                after: &plant,
                sensors: &Default::default(),
                cross_fit: &addition.added.cross_fit,
                own: addition.added.own.as_ref(),
                recalibrated: &addition.added.recalibrated,
                commands_before: 0.0,
            },
            held_out,
            all,
            &found.channels,
            &settings(),
            &watch,
        )
        .unwrap();
        assert!(
            verified.gap.before.is_some_and(|error| error > 0.1),
            "{:?}",
            verified.gap
        );
    }
}

/// Nothing is missing: no gap is claimed.
#[test]
fn a_table_without_a_gap_has_none() {
    let (_folder, plant) = towed("Euler");
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let all = trials(&plant, &tows(0.0, true));
    let problem = Problem::prepare(&plant, all, settings(), &watch).unwrap();
    let followed = hydro_gap::Followed::new(&problem, &watch).unwrap();
    let explanation = hydro_gap::explain(&followed, &watch).unwrap();
    let naming = hydro_gap::name(&explanation, &watch).unwrap();
    assert_eq!(
        naming.named.outcome,
        Outcome::NoGap,
        "{:?}",
        naming.named.ranking
    );
}

#[test]
fn without_a_sensor_of_force_a_prescribed_model_is_refused() {
    let (_folder, plant) = plant(
        r#"<mujoco><worldbody><body name="carriage"><joint name="tow" type="slide"/><geom size="0.1"/></body></worldbody>
        <sensor><jointvel name="speed" joint="tow"/></sensor></mujoco>"#,
    );
    let all = trials(&plant, "tow_vel,speed\n1,1\n2,2\n3,3\n");
    let stop = AtomicBool::new(false);
    let error = Problem::prepare(&plant, all, settings(), &Watch::silent(&stop)).unwrap_err();
    assert!(matches!(error, GapError::NoForces { .. }), "{error}");
    let text = error.to_string();
    for part in ["steady-01", "speed", "`force` or `torque`"] {
        assert!(text.contains(part), "{text}");
    }
}
