//! Noise that stands in the log of the commands alone, and commands that are white themselves.

use std::sync::atomic::AtomicBool;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{fake::RigidBody, settings, trial};
use crate::{
    likelihood::{explain::explain, followed::Followed},
    output::verdict::Outcome,
    plant::Plant,
    problem::problem::Problem,
    progress::Watch,
    stage::name::name,
    statistics::standard_normal,
    trial::Trial,
};

/// Standard deviation of the noise; commands move by 0.45.
const NOISE: f64 = 0.1;

/// Nothing is missing; every command was logged with white noise, at the rows of the sensors.
fn logged_with_noise(seed: u64) -> Trial {
    let mut made = trial("noisy", &[], &[0.0, 0.0], seed, 1.0);
    let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
    made.control = made.control.resample(&made.sensors.times);
    for value in &mut made.control.data {
        *value += NOISE * standard_normal(&mut rng);
    }
    made
}

/// Nothing is missing; every row has a command of its own, and the robot obeys it.
fn white_by_design(seed: u64) -> Trial {
    let mut made = logged_with_noise(seed);
    let plant = RigidBody::with_gains();
    let mut simulation = plant.simulation(&[0.0, 0.0], &[]).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(200 + seed);
    let sds: Vec<f64> = (plant.description().sensors.iter())
        .flat_map(|of| vec![if of.len == 4 { 0.5 } else { 1.0 } * of.noise; of.len])
        .collect();
    let mut command = [0.0; 4];
    made.sensors.data.clear();
    for step in 0..2000 {
        made.control
            .interpolate(f64::from(step) * 0.005, &mut command);
        simulation.set_control(&command);
        simulation.step();
        if step % 4 == 0 {
            let read = simulation.sensors().iter().zip(&sds);
            let read = read.map(|(value, sd)| value + sd * standard_normal(&mut rng));
            made.sensors.data.extend(read);
        }
    }
    made
}

/// The verdict, and the noise that was found.
fn judged(make: fn(u64) -> Trial, looks_at_commands: bool) -> (Outcome, Vec<f64>) {
    let plant = RigidBody::with_gains();
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let trials = (0..2).map(make).collect();
    let mut problem = Problem::prepare(&plant, trials, settings(), &watch).unwrap();
    if looks_at_commands {
        problem = problem.with_likelier_commands(&watch).unwrap();
    }
    let followed = Followed::new(&problem, &watch).unwrap();
    let explanation = explain(&followed, &watch).unwrap();
    let named = name(&explanation, &watch).unwrap().named;
    (named.outcome, problem.command_noise.clone())
}

#[test]
fn noise_in_the_log_of_commands_is_no_gap() {
    let (outcome, noise) = judged(logged_with_noise, true);
    assert_eq!(noise.len(), 4);
    for found in noise {
        assert!((found / NOISE - 1.0).abs() < 0.15, "{found}");
    }
    assert_eq!(outcome, Outcome::NoGap);
    // Taken for what the robot obeyed, it is one.
    let (outcome, noise) = judged(logged_with_noise, false);
    assert!(noise.is_empty());
    assert_ne!(outcome, Outcome::NoGap);
}

#[test]
fn commands_that_the_robot_obeys_stay_as_they_are() {
    let (outcome, noise) = judged(white_by_design, true);
    assert!(noise.is_empty(), "{noise:?}");
    assert_eq!(outcome, Outcome::NoGap);
}
