//! Yardsticks against values found by hand.

use super::*;
use crate::dataset::{Dataset, Manifest, SCHEMA, Trajectory, write};

/// Two trajectories of three samples of one force, without a recorded buoyancy.
fn split() -> Split {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest: Manifest = serde_json::from_value(serde_json::json!({
        "schema": SCHEMA, "name": "small", "features": ["linear_velocity.x"], "feature_units": ["m/s"],
        "outputs": ["force.x"], "output_units": ["N"], "frames": {"wrench": "base"},
        "sample_period": 0.01, "samples": 3, "splits": {},
    }))
    .expect("a manifest");
    let trajectory = |wrench: [f32; 3]| Trajectory {
        x: vec![0.1, 0.2, 0.3],
        wrench: wrench.to_vec(),
    };
    let trajectories = vec![trajectory([1.0, 2.0, 3.0]), trajectory([-4.0, 0.0, 5.0])];
    let set: Dataset =
        write(folder.path(), &manifest, &[("test", trajectories)]).expect("a data set");
    set.split("test", None).expect("its split")
}

#[test]
fn the_first_force_is_held_and_a_buoyancy_that_nobody_recorded_is_no_yardstick() {
    let split = split();
    assert_eq!(Yardstick::of_split(&split), [Yardstick::FirstForce]);
    assert_eq!(Yardstick::FirstForce.predict(&split, 0), [1.0; 3]);
    assert_eq!(Yardstick::FirstForce.predict(&split, 1), [-4.0; 3]);
    assert_eq!(Yardstick::Buoyancy.predict(&split, 1), [0.0; 3]);
}
