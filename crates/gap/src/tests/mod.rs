//! A simulated rigid body, its trials, and the workflow on them.
#![allow(clippy::unwrap_used)]

mod by_trial;
pub(crate) mod fake;
mod likelihood;
mod motion;
mod noisy_commands;
mod own_effect;
mod refusals;
mod timing;
mod workflow;

use std::{f64::consts::TAU, sync::atomic::AtomicBool};

use hydro_effects::{Entry, Id};
use hydro_frames::Wrench;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use fake::RigidBody;

use crate::{
    options::Options,
    plant::Plant,
    problem::{
        problem::{Problem, Settings},
        uncertainty::Uncertainty,
    },
    progress::Watch,
    statistics::standard_normal,
    trial::{Series, Trial},
};

/// As the workflow is run unless it is told otherwise.
pub(crate) fn settings() -> Settings {
    Settings {
        medium: None,
        uncertainty: Uncertainty::default(),
        seed: 0,
        own_effects: Vec::new(),
        options: Options::default(),
    }
}

/// Hands over what the trials make on a plant.
pub(crate) fn on_prepared(
    plant: &dyn Plant,
    trials: Vec<Trial>,
    test: impl FnOnce(&Problem<'_>, &Watch<'_>),
) {
    under(settings(), plant, trials, test);
}

/// The same under other settings.
pub(crate) fn under(
    settings: Settings,
    plant: &dyn Plant,
    trials: Vec<Trial>,
    test: impl FnOnce(&Problem<'_>, &Watch<'_>),
) {
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let problem = Problem::prepare(plant, trials, settings, &watch).unwrap();
    test(&problem, &watch);
}

/// An effect on the body of [`RigidBody`].
pub(crate) fn on_hull(effect: Id, parameters: Vec<f64>) -> Entry {
    Entry {
        effect,
        target: "hull".to_owned(),
        parameters,
    }
}

pub(crate) fn trial(
    name: &str,
    effects: &[Entry],
    nuisances: &[f64],
    seed: u64,
    noise: f64,
) -> Trial {
    pushed(name, effects, nuisances, seed, noise, &|_, _| [0.0; 6])
}

/// A wrench on the base that depends on positions and velocities [N, N m].
pub(crate) type Push = dyn Fn(&[f64], &[f64]) -> [f64; 6];

/// The same with such a wrench.
pub(crate) fn pushed(
    name: &str,
    effects: &[Entry],
    nuisances: &[f64],
    seed: u64,
    noise: f64,
    push: &Push,
) -> Trial {
    let plant = RigidBody::with_gains();
    let mut simulation = plant.simulation(nuisances, effects).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let phases: Vec<f64> = (0..8).map(|_| 3.0 * standard_normal(&mut rng)).collect();
    let mut control = Series {
        times: vec![],
        columns: vec![],
        data: vec![],
    };
    control.columns = plant
        .description()
        .actuators
        .iter()
        .map(|a| a.name.clone())
        .collect();
    let mut sensors = Series {
        times: vec![],
        columns: vec![],
        data: vec![],
    };
    for sensor in &plant.description().sensors {
        for component in 0..sensor.len {
            sensors
                .columns
                .push(format!("{}[{component}]", sensor.name));
        }
    }
    // The noise of an attitude is that of its rotation vector: half of it stands in the quaternion.
    let sds: Vec<f64> = plant
        .description()
        .sensors
        .iter()
        .flat_map(|s| vec![if s.len == 4 { 0.5 } else { 1.0 } * s.noise; s.len])
        .collect();
    for step in 0..2000 {
        let time = f64::from(step) * 0.005;
        let command: Vec<f64> = (0..4)
            .map(|a| {
                0.5 * (TAU * 0.3 * time + phases[a]).sin()
                    + 0.4 * (TAU * 0.11 * time + phases[a + 4]).sin()
            })
            .collect();
        simulation.set_control(&command);
        let wrench = push(simulation.qpos(), simulation.qvel());
        simulation.set_base_wrench(Wrench::from_array(wrench));
        control.times.push(time);
        control.data.extend(&command);
        simulation.step();
        if step % 4 == 0 {
            sensors.times.push(time + 0.005);
            for (value, sd) in simulation.sensors().iter().zip(&sds) {
                sensors
                    .data
                    .push(value + noise * sd * standard_normal(&mut rng));
            }
        }
    }
    Trial {
        name: name.to_owned(),
        control,
        sensors,
        ..Trial::default()
    }
}
