//! A rigid body under a wrench outside the catalogue.
#![allow(clippy::unwrap_used)]

use std::sync::atomic::AtomicBool;

use hydro_frames::world_from_base;

use crate::{
    options::Options,
    problem::{
        problem::{Problem, Settings},
        uncertainty::Uncertainty,
    },
    progress::Watch,
    residual::*,
    tests::{Push, fake::RigidBody, pushed},
};

/// Yaw and the speed ahead of a state.
fn heading(qpos: &[f64], qvel: &[f64]) -> (f64, f64) {
    let attitude = world_from_base([qpos[3], qpos[4], qpos[5], qpos[6]]);
    let (_, _, yaw) = attitude.euler_angles();
    let ahead = attitude.inverse() * nalgebra::Vector3::new(qvel[0], qvel[1], qvel[2]);
    (yaw, ahead.x)
}

/// A side force and a turning moment with the sine of the yaw times the speed.
fn hidden(qpos: &[f64], qvel: &[f64]) -> [f64; 6] {
    let (yaw, ahead) = heading(qpos, qvel);
    let strength = yaw.sin() * ahead;
    [0.0, 15.0 * strength, 0.0, 0.0, 0.0, 3.0 * strength]
}

fn estimated(push: &Push) -> MissingWrench {
    let plant = RigidBody::new();
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let trials = (0..2)
        .map(|at| pushed(&format!("trial {at}"), &[], &[0.0, 0.0], at, 1.0, push))
        .collect();
    let settings = Settings {
        medium: None,
        uncertainty: Uncertainty::default(),
        seed: 0,
        own_effects: Vec::new(),
        options: Options::default(),
    };
    let problem = Problem::prepare(&plant, trials, settings, &watch).unwrap();
    let Residual::Found(found) = residual(&problem, &[0.0, 0.0], &watch).unwrap() else {
        panic!("not offered");
    };
    found
}

#[test]
fn a_wrench_outside_the_catalogue_is_found_within_its_stated_error() {
    let found = estimated(&hidden);
    assert_eq!(found.series.len(), 2);
    assert!((found.sample_period - 0.02).abs() < 1e-12);
    let (mut square, mut count) = (0.0, 0_usize);
    let mut explained = [[0.0; 2]; 6];
    for series in &found.series {
        assert!(series.times.len() > 450, "{}", series.times.len());
        for (at, wrench) in series.wrench.iter().enumerate() {
            let truth = hidden(&series.qpos[at], &series.qvel[at]);
            for axis in 0..6 {
                let error = wrench[axis] - truth[axis];
                square += (error / series.sd[at][axis]).powi(2);
                count += 1;
                explained[axis][0] += error * error;
                explained[axis][1] += truth[axis] * truth[axis];
            }
        }
    }
    let deviation = (square / count as f64).sqrt();
    assert!((0.3..1.5).contains(&deviation), "{deviation}");
    for axis in [1, 5] {
        let [error, truth] = explained[axis];
        assert!(error < 0.1 * truth, "axis {axis}: {error} of {truth}");
    }
}

#[test]
fn without_a_missing_wrench_none_is_found() {
    let found = estimated(&|_, _| [0.0; 6]);
    for series in &found.series {
        for (wrench, sd) in series.wrench.iter().zip(&series.sd) {
            for axis in 0..6 {
                assert!(wrench[axis].abs() < 4.0 * sd[axis], "{wrench:?} {sd:?}");
                assert!(wrench[axis].abs() < 1.0, "{wrench:?}");
            }
        }
    }
}
