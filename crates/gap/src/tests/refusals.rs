//! Errors and remarks about data and models that the workflow cannot use, or only in part.
#![allow(clippy::unwrap_used)]

use std::sync::atomic::{AtomicBool, Ordering};

use crate::{
    error::GapError,
    likelihood::{explain::explain, followed::Followed},
    options::Options,
    output::verdict::Outcome,
    plant::Plant,
    problem::{problem::Problem, uncertainty::Uncertainty},
    progress::Watch,
    stage::{locate::locate, name::name},
    tests::{fake::RigidBody, settings, trial},
    trial::Trial,
};

fn trials(count: u64, noise: f64) -> Vec<Trial> {
    (0..count)
        .map(|at| trial(&format!("trial {at}"), &[], &[0.0, 0.0], at, noise))
        .collect()
}

/// Prepares, sees the nominal through the first stage, and returns what was remarked.
fn remarks(plant: &RigidBody, trials: Vec<Trial>) -> Result<Vec<String>, GapError> {
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let problem = Problem::prepare(plant, trials, settings(), &watch)?;
    let followed = Followed::new(&problem, &watch)?;
    Ok(locate(&followed, &[], &watch)?.remarks)
}

fn fault(plant: &RigidBody, trials: Vec<Trial>) -> String {
    remarks(plant, trials).unwrap_err().to_string()
}

#[test]
fn a_nominal_that_diverges_by_itself_is_said() {
    let said = fault(&RigidBody::unstable(), trials(2, 1.0));
    for part in ["diverges by itself", "trial 0", "timestep (0.005 s)"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn readings_of_no_sensor_of_the_model_are_nothing_to_compare() {
    let mut strange = trials(1, 1.0);
    for column in &mut strange[0].sensors.columns {
        *column = column.replace("dvl", "log").replace("gyro", "rate");
        *column = column
            .replace("position", "place")
            .replace("attitude", "pose");
    }
    let said = fault(&RigidBody::new(), strange);
    for part in ["trial 0", "`position`, `attitude`, `dvl`, `gyro`"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn a_trial_of_a_few_rows_is_too_short() {
    let mut short = trials(1, 1.0);
    let sensors = &mut short[0].sensors;
    sensors.times.truncate(5);
    sensors.data.truncate(5 * sensors.columns.len());
    let said = fault(&RigidBody::new(), short);
    assert!(said.contains("`trial 0` has 5 rows"), "{said}");
    assert!(said.contains("at least 8"), "{said}");
}

#[test]
fn constant_controls_excite_nothing_and_it_is_said() {
    let mut constant = trials(2, 1.0);
    for trial in &mut constant {
        trial.control.data.fill(0.3);
    }
    let said = remarks(&RigidBody::new(), constant).unwrap().join("; ");
    assert!(said.contains("excite nothing"), "{said}");
    let varied = remarks(&RigidBody::new(), trials(2, 1.0)).unwrap();
    assert!(
        varied.iter().all(|text| !text.contains("excite")),
        "{varied:?}"
    );
}

#[test]
fn noise_that_nobody_declared_is_estimated_and_it_is_said() {
    let silent = RigidBody::without_noise("dvl");
    let said = remarks(&silent, trials(2, 1.0)).unwrap().join("; ");
    assert!(said.contains("no noise for dvl"), "{said}");
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let problem = Problem::prepare(&silent, trials(2, 1.0), settings(), &watch).unwrap();
    let estimated = problem.channels.list.iter().filter(|c| c.sensor == "dvl");
    for channel in estimated {
        // The truth is 0.01 m/s.
        assert!((0.006..0.015).contains(&channel.noise), "{channel:?}");
    }
    let followed = Followed::new(&problem, &watch).unwrap();
    let explanation = explain(&followed, &watch).unwrap();
    let naming = name(&explanation, &watch).unwrap();
    assert_eq!(naming.named.outcome, Outcome::NoGap);
}

#[test]
fn a_stop_is_heeded() {
    let stop = AtomicBool::new(false);
    let watch = Watch {
        stop: &stop,
        tell: &|_, _, _| stop.store(true, Ordering::Relaxed),
    };
    let plant = RigidBody::new();
    let stopped = Problem::prepare(&plant, trials(4, 1.0), settings(), &watch)
        .and_then(|problem| Followed::new(&problem, &watch).map(|_| ()));
    assert!(matches!(stopped, Err(GapError::Stopped)), "{stopped:?}");
}

#[test]
fn an_uncertainty_file_that_does_not_fit_is_refused_by_key() {
    let plant = RigidBody::new();
    let nuisances = &plant.description().nuisances;
    for (text, expected) in [
        ("mass = -0.1", vec!["`mass` is -0.1", "zero or more"]),
        ("weight = 0.1", vec!["weight", "mass"]),
        ("[elements]\nhull = nan", vec!["`hull` is NaN"]),
        (
            "[elements]\nkeel = 0.1",
            vec!["`keel`", "hull, hull.drag, hull.mass"],
        ),
        ("mass = ", vec!["mass"]),
        (
            "gain_by_trial = -0.02",
            vec!["`gain_by_trial` is -0.02", "zero or more"],
        ),
        (
            "gain = 0\ngain_by_trial = 0.05",
            vec!["`gain_by_trial`", "`gain = 0`", "0.001"],
        ),
    ] {
        let said = Uncertainty::parse(text, nuisances).unwrap_err().to_string();
        for part in expected {
            assert!(said.contains(part), "{text}: {said}");
        }
    }
    let read =
        Uncertainty::parse("mass = 0.1\n[elements]\n\"hull.drag\" = 0.2", nuisances).unwrap();
    let options = Options::default().candidates;
    let deviation = |at: usize| read.standard_deviation(&nuisances[at], &options);
    assert_eq!((deviation(0), deviation(1)), (0.1, 0.2));
}
