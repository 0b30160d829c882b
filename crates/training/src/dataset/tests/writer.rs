//! A data set written and read back.
#![allow(clippy::unwrap_used)]

use super::*;
use hydro_model::features::Feature;
use hydro_model::features::FeatureLayout;

#[test]
fn what_is_written_is_read_back_and_a_wrong_length_refused() {
    let about = Manifest {
        schema: super::super::SCHEMA.to_owned(),
        name: "small".to_owned(),
        features: FeatureLayout::new(vec![Feature::LinearVelocity(0), Feature::Density]).unwrap(),
        feature_units: vec!["m/s".to_owned(), "kg/m^3".to_owned()],
        outputs: vec!["force.x".to_owned()],
        output_units: vec!["N".to_owned()],
        frames: BTreeMap::from([("wrench".to_owned(), "base".to_owned())]),
        sample_period: 0.02,
        samples: 3,
        kinematics: None,
        generalised: None,
        water: None,
        added_mass: Vec::new(),
        splits: BTreeMap::new(),
        provenance: BTreeMap::new(),
    };
    let trajectory = |of: f32| Trajectory {
        x: vec![of, 1000.0, of + 1.0, 1000.0, of + 2.0, 1000.0],
        wrench: vec![of, -of, 0.5],
    };
    let folder = tempfile::tempdir().unwrap();
    let splits = [
        ("train", vec![trajectory(1.0), trajectory(7.0)]),
        ("val", vec![trajectory(3.0)]),
    ];
    let dataset = write(folder.path(), &about, &splits).unwrap();
    let train = dataset.split("train", None).unwrap();
    assert_eq!((train.len(), train.samples()), (2, 3));
    assert_eq!(train.x(1), trajectory(7.0).x);
    assert_eq!(train.clean(0), trajectory(1.0).wrench);
    assert_eq!(dataset.split("val", None).unwrap().wrench(0)[0], 3.0);
    let mut short = trajectory(1.0);
    short.wrench.pop();
    let text = write(folder.path(), &about, &[("train", vec![short])])
        .unwrap_err()
        .to_string();
    assert!(text.contains("train-00000"), "{text}");
}
