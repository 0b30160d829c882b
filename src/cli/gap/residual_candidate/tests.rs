//! A small vehicle in MuJoCo's own fluid, under a wrench that no effect describes: from trials to a patched
//! model that predicts held-out ones better.
#![allow(clippy::unwrap_used)]

use std::{f64::consts::TAU, sync::atomic::AtomicBool};

use hydro_frames as frames;
use hydro_frames::Wrench;
use hydro_gap::{
    Settings, Uncertainty, VerifyInput,
    plant::Plant,
    trial::{Series, Trial},
    verify,
};
use hydro_plugin::mujoco::plant::MujocoPlant;

use super::*;

/// A hull with a fin, four thrusters, and what a vehicle knows of its motion.
const VEHICLE: &str = r#"<mujoco>
  <option timestep="0.01" integrator="implicitfast" density="1000" viscosity="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="hull"><freejoint/>
      <geom type="ellipsoid" size="0.3 0.2 0.15" mass="20" fluidshape="ellipsoid"/>
      <site name="imu"/>
      <body name="fin" pos="-0.3 0 0"><joint name="fin" axis="0 0 1" stiffness="0.1" damping="0.02"/>
        <geom type="box" pos="-0.1 0 0" size="0.05 0.01 0.05" mass="0.5"/></body>
    </body>
  </worldbody>
  <actuator>
    <motor name="ahead" site="imu" gear="20 0 0 0 0 0"/>
    <motor name="aside" site="imu" gear="0 20 0 0 0 0"/>
    <motor name="up" site="imu" gear="0 0 10 0 0 0"/>
    <motor name="turn" site="imu" gear="0 0 0 0 0 3"/>
  </actuator>
  <sensor>
    <framepos name="position" objtype="xbody" objname="hull" noise="0.005"/>
    <framequat name="attitude" objtype="xbody" objname="hull" noise="0.003"/>
    <gyro name="gyro" site="imu" noise="0.005"/>
    <velocimeter name="dvl" site="imu" noise="0.005"/>
    <jointpos name="fin" joint="fin" noise="0.003"/>
  </sensor>
</mujoco>"#;

/// A side force with the speed ahead and the square of the yaw rate, and a moment with it.
fn hidden(qpos: &[f64], qvel: &[f64]) -> [f64; 6] {
    let attitude = [qpos[3], qpos[4], qpos[5], qpos[6]];
    let ahead = frames::base_from_world(attitude, [qvel[0], qvel[1], qvel[2]])[0];
    let strength = ahead * qvel[5] * qvel[5].abs();
    [0.0, 25.0 * strength, 0.0, 0.0, 0.0, 2.0 * strength]
}

/// A trial of 8 s under the hidden wrench, noise and all.
fn trial(plant: &MujocoPlant, at: usize) -> Trial {
    let model = plant.description();
    let mut simulation = plant
        .simulation(&vec![0.0; model.nuisances.len()], &[])
        .unwrap();
    let mut chance = 0.5 + at as f64;
    let mut noise = || {
        let uniform = (0..12).map(|_| {
            chance = (chance * 997.13 + 0.1234).fract();
            chance
        });
        uniform.sum::<f64>() - 6.0
    };
    let phases: Vec<f64> = (0..8).map(|axis| (at * 8 + axis) as f64 * 2.4).collect();
    let columns = |names: Vec<String>| Series {
        times: vec![],
        columns: names,
        data: vec![],
    };
    let mut control = columns(model.actuators.iter().map(|a| a.name.clone()).collect());
    let named = model.sensors.iter().flat_map(|sensor| {
        (0..sensor.len).map(move |component| match sensor.len {
            1 => sensor.name.clone(),
            _ => format!("{}[{component}]", sensor.name),
        })
    });
    let mut sensors = columns(named.collect());
    let sds: Vec<f64> = model
        .sensors
        .iter()
        .flat_map(|s| vec![if s.len == 4 { 0.5 } else { 1.0 } * s.noise; s.len])
        .collect();
    for step in 0..800 {
        let time = 0.01 * f64::from(step);
        let command: Vec<f64> = (0..4)
            .map(|axis| {
                0.5 * (TAU * 0.25 * time + phases[axis]).sin()
                    + 0.4 * (TAU * 0.1 * time + phases[axis + 4]).sin()
            })
            .collect();
        simulation.set_control(&command);
        let wrench = hidden(simulation.qpos(), simulation.qvel());
        simulation.set_base_wrench(Wrench::from_array(wrench));
        control.times.push(time);
        control.data.extend(&command);
        simulation.step();
        if step % 2 == 0 {
            sensors.times.push(time + 0.01);
            let readings = simulation.sensors().iter().zip(&sds);
            sensors
                .data
                .extend(readings.map(|(value, sd)| value + sd * noise()));
        }
    }
    Trial {
        name: format!("trial {at}"),
        control,
        sensors,
        ..Trial::default()
    }
}

#[test]
fn a_learned_residual_loads_and_predicts_held_out_trials_better() {
    let place = tempfile::tempdir().unwrap();
    let nominal = place.path().join("nominal.xml");
    fs::write(&nominal, VEHICLE).unwrap();
    let plant = MujocoPlant::load(&nominal).unwrap();
    let settings = Settings {
        medium: None,
        uncertainty: Uncertainty::default(),
        seed: 0,
        own_effects: Vec::new(),
        options: hydro_gap::Options::default(),
    };
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let trials = (0..4).map(|at| trial(&plant, at)).collect();
    let study = Problem::prepare(&plant, trials, settings.clone(), &watch).unwrap();
    let task = Task {
        nominal: &nominal,
        model: plant.description(),
        out: place.path(),
        seed: 0,
        nuisances: vec![(0.0, 0.0); plant.description().nuisances.len()],
    };
    let made = candidate(&task, &study, &watch).unwrap();
    assert!(made.added.is_written(), "{:?}", made.added.remarks);
    assert!(made.added.remarks[0].contains("of no name"));
    for (name, bytes) in &made.residual {
        let path = place.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    let patched = place.path().join("candidate.xml");
    fs::write(&patched, made.xml.unwrap()).unwrap();
    let after = MujocoPlant::load(&patched).unwrap();
    assert!(after.description().base.as_ref().unwrap().learned);
    let card = Checkpoint::load(&place.path().join(RESIDUAL)).unwrap().card;
    assert!(card.residual && card.joints == ["fin"]);
    assert_eq!(card.outputs, ["force.y", "torque.z"]);
    let held_out = (10..13).map(|at| trial(&plant, at)).collect();
    let sensors = [].into();
    let examined = VerifyInput {
        before: &plant,
        after: &after,
        sensors: &sensors,
        cross_fit: &[],
        recalibrated: &[],
        commands_before: 0.0,
        own: None,
    };
    let verified = verify(&examined, held_out, Vec::new(), &[], &settings, &watch).unwrap();
    assert!(
        verified.accepted,
        "{:?} {:?} {:?} {:?} {:?}",
        verified.refused_because, made.added.remarks, card.model, card.metrics, verified.gap
    );
    assert!(verified.gap.reduction.unwrap() > 0.4, "{:?}", verified.gap);

    // A body has room for one.
    let trials = (0..2).map(|at| trial(&plant, at)).collect();
    let again = Problem::prepare(&after, trials, settings, &watch).unwrap();
    let made = candidate(&task, &again, &watch).unwrap();
    assert!(made.xml.is_none() && made.added.remarks[0].contains("learned wrench already"));
}

#[test]
fn a_base_without_a_free_joint_has_none() {
    let place = tempfile::tempdir().unwrap();
    let nominal = place.path().join("nominal.xml");
    let fixed = VEHICLE.replace(
        "<freejoint/>",
        "<joint name=\"rail\" type=\"slide\" axis=\"1 0 0\"/>",
    );
    fs::write(&nominal, fixed).unwrap();
    let plant = MujocoPlant::load(&nominal).unwrap();
    assert_eq!(plant.description().base, None);
    let settings = Settings {
        medium: None,
        uncertainty: Uncertainty::default(),
        seed: 0,
        own_effects: Vec::new(),
        options: hydro_gap::Options::default(),
    };
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let mut log = trial_of_a_rail(&plant);
    log.name = "rail".to_owned();
    let study = Problem::prepare(&plant, vec![log], settings, &watch).unwrap();
    let task = Task {
        nominal: &nominal,
        model: plant.description(),
        out: place.path(),
        seed: 0,
        nuisances: vec![(0.0, 0.0); plant.description().nuisances.len()],
    };
    let made = candidate(&task, &study, &watch).unwrap();
    let remark = &made.added.remarks[0];
    assert_eq!(remark, "a learned residual needs a free joint; not offered");
    assert!(made.xml.is_none() && made.residual.is_empty() && !made.added.is_written());
}

/// One second on a rail, at rest.
fn trial_of_a_rail(plant: &MujocoPlant) -> Trial {
    let model = plant.description();
    let mut simulation = plant
        .simulation(&vec![0.0; model.nuisances.len()], &[])
        .unwrap();
    let rows: Vec<f64> = (1..=50).map(|row| 0.02 * f64::from(row)).collect();
    simulation.step();
    let readings = simulation.sensors().to_vec();
    let names = model.sensors.iter().flat_map(|sensor| {
        (0..sensor.len).map(move |component| match sensor.len {
            1 => sensor.name.clone(),
            _ => format!("{}[{component}]", sensor.name),
        })
    });
    Trial {
        name: String::new(),
        control: Series {
            times: vec![0.0, 1.0],
            columns: model.actuators.iter().map(|a| a.name.clone()).collect(),
            data: vec![0.0; 2 * model.actuators.len()],
        },
        sensors: Series {
            columns: names.collect(),
            data: readings.repeat(rows.len()),
            times: rows,
        },
        ..Trial::default()
    }
}
