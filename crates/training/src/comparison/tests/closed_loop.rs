//! Distances by hand, on a point mass.
#![allow(clippy::unwrap_used)]

use hydro_frames::Wrench;

use super::*;
use crate::{
    comparison::{Water, point_mass::PointMass},
    rollouts::Table,
};
use std::convert::Infallible;

/// A 2 kg mass pulled by a constant 1 N along x in the water's wrench, from rest.
fn run() -> Rollout {
    let samples = 201;
    let time: Vec<f64> = (0..samples).map(|k| k as f64 * 0.01).collect();
    let row = |t: &f64| vec![0.25 * t * t, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let table = |values: Vec<f64>, columns| Table::new(values, columns).unwrap();
    Rollout {
        name: "pull".into(),
        density: 1000.0,
        qpos: table(time.iter().flat_map(row).collect(), 7),
        qvel: table(
            time.iter()
                .flat_map(|t| [0.5 * t, 0.0, 0.0, 0.0, 0.0, 0.0])
                .collect(),
            6,
        ),
        ctrl: table(vec![0.0; samples - 1], 1),
        push: table(vec![0.0; 6 * (samples - 1)], 6),
        x: table(vec![1000.0; samples], 1),
        wrench: table([1.0, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(samples), 6),
        hydrostatic: table(vec![0.0; 6 * samples], 6),
        generalised: None,
        step_force: Some(table(
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(5 * (samples - 1)),
            30,
        )),
        time,
    }
}

fn method<'a>(name: &str, water: Water<'a>) -> Method<'a, Infallible> {
    Method {
        name: name.into(),
        simulator: Box::new(|_| Ok(Box::new(PointMass::new(2.0, 0.002)))),
        water,
    }
}

#[test]
fn a_replayed_wrench_follows_the_truth_and_no_water_falls_behind_as_computed() {
    let methods = [
        method("oracle", Water::Replayed),
        method("none", Water::Scene),
        method("steps", Water::Steps { joints: true }),
        method(
            "half",
            Water::Law(Box::new(|_, density| {
                Wrench::from_array([0.5 * density / 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0])
            })),
        ),
    ];
    let result = closed_loop(&methods, &[run()], &[1.0, 2.0, 4.0], &|_| ()).unwrap();
    assert_eq!(result.horizons, [1.0, 2.0], "the run lasts 2 s");
    assert!(result.rows[0].position[1].median < 1e-9);
    assert!((result.rows[1].position[0].median - 0.25).abs() < 1e-9);
    assert!((result.rows[1].position[1].median - 1.0).abs() < 1e-9);
    assert!(result.rows[2].position[1].median < 1e-9);
    assert!((result.rows[3].position[1].median - 0.5).abs() < 1e-9);
    assert_eq!(result.rows[0].path.len(), 201);
}

#[test]
fn a_quarter_turn_is_ninety_degrees_and_divergence_is_infinite() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (_, angle) = pose_error(
        &[0.0, 0.0, 0.0, half, half, 0.0, 0.0],
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
    );
    assert!((angle - 90.0).abs() < 1e-9);
    let (distance, _) = pose_error(&[f64::NAN; 7], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(distance, f64::INFINITY);
}

#[test]
fn a_joint_error_is_the_root_mean_square_in_degrees() {
    let pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let with = |joints: &[f64]| [&pose[..], joints].concat();
    let one = joint_error(&with(&[1.3, -0.4]), &with(&[1.0, 0.0]));
    assert!((one - 0.125f64.sqrt().to_degrees()).abs() < 1e-9, "{one}");
    assert_eq!(joint_error(&pose, &pose), 0.0);
    assert_eq!(
        joint_error(&with(&[f64::NAN]), &with(&[0.0])),
        f64::INFINITY
    );
}

#[test]
fn spread_is_that_of_the_textbook() {
    let spread = Spread::from_values(&[1.0, 2.0, 3.0, 6.0]);
    assert_eq!((spread.median, spread.mean), (2.5, 3.0));
    assert!((spread.standard_error - (14.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
}
