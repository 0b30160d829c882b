//! Rows without learning beside rows of the paper.

use super::*;
use crate::dataset::{Manifest, SCHEMA, Trajectory, write};

#[test]
fn a_held_force_has_the_errors_of_its_definition() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest: Manifest = serde_json::from_value(serde_json::json!({
        "schema": SCHEMA, "name": "small", "features": ["linear_velocity.x"], "feature_units": ["m/s"],
        "outputs": ["force.x"], "output_units": ["N"], "frames": {"wrench": "base"},
        "sample_period": 0.01, "samples": 3, "splits": {},
    }))
    .expect("a manifest");
    let one = Trajectory {
        x: vec![0.0; 3],
        wrench: vec![1.0, 2.0, 4.0],
    };
    let set = write(folder.path(), &manifest, &[("test", vec![one])]).expect("a data set");
    let rows = yardsticks("1.1", &set.split("test", None).expect("its split"));
    // Errors 1 and 3 of the samples after the first.
    let held = &rows[0];
    assert_eq!(held.label, "the first force, held (no learning)");
    assert!((held.values["mae"].mean - 2.0).abs() < 1e-12);
    assert!((held.values["rmse"].mean - 5f64.sqrt()).abs() < 1e-12);
    // Of 2 and 4 the deviation is 1.
    assert!((held.values["nrmse"].mean - 5f64.sqrt()).abs() < 1e-12);
    assert!(!held.competes && held.seeds.is_empty());
    assert_eq!(rows.len(), 1 + 4);
}

#[test]
fn the_papers_numbers_are_those_that_it_prints() {
    let task2 = printed("2");
    let lstm = task2.last().expect("four rows");
    assert_eq!(lstm.label, "the paper prints: LSTM (80 ms)");
    assert_eq!(lstm.parameters, Some(828_422));
    assert_eq!(
        (lstm.values["mae"].mean, lstm.values["rmse"].mean),
        (16.3, 43.9)
    );
    let noisy = printed("1.3");
    assert_eq!(
        (noisy[3].values["mae"].mean, noisy[3].values["rmse"].mean),
        (2.1, 4.2)
    );
}
