//! A wrench that is learned, and those that are not offered.
#![allow(clippy::unwrap_used)]

use hydro_model::features::FeatureLayout;

use super::*;
use crate::residual_model::RecordedWrench;

/// Trials of a body that goes to and fro; `wrench` from speed, time and a number that is never the
/// same.
fn missing(trials: usize, wrench: &dyn Fn(f64, f64) -> f64) -> ResidualData {
    let features = FeatureLayout::floating_base(&[]).unwrap();
    let units = features.features().iter().map(|f| f.unit().to_owned());
    let recorded = (0..trials).map(|trial| {
        let mut of = RecordedWrench {
            x: Vec::new(),
            wrench: Vec::new(),
            sd: Vec::new(),
        };
        for k in 0..300 {
            let time = 0.02 * f64::from(k) + 1.7 * trial as f64;
            let speed = (1.3 * time).sin() + 0.4 * (3.1 * time + trial as f64).cos();
            let mut x = vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            x.extend([speed, 0.0, 0.0, 1000.0]);
            of.x.extend(x.iter().map(|value| *value as f32));
            let chance = (f64::from(k / 10) * 12.9898 + trial as f64 * 78.233).sin() * 43758.5;
            of.wrench
                .push([wrench(speed, chance.fract()), 0.0, 0.0, 0.0, 0.0, 0.0]);
            of.sd.push([0.3; 6]);
        }
        of
    });
    ResidualData {
        recorded: recorded.collect(),
        feature_units: units.collect(),
        features,
        sample_period: 0.02,
        seed: 0,
        command: "a test".to_owned(),
    }
}

fn learn(missing: &ResidualData) -> LearnedResidual {
    learn_residual(missing, &AtomicBool::new(false), &|_, _| {}).unwrap()
}

#[test]
fn a_wrench_of_the_motion_is_learned_on_its_own_axis_alone() {
    let learned = learn(&missing(4, &|speed, _| -8.0 * speed * speed.abs()));
    let LearnedResidual::Model { checkpoint, skill } = learned else {
        panic!("{learned:?}");
    };
    assert!(skill > 0.9, "{skill}");
    assert_eq!(checkpoint.card.outputs, ["force.x"]);
    assert!(checkpoint.card.residual);
    let folder = tempfile::tempdir().unwrap();
    checkpoint.save(&folder.path().join("residual")).unwrap();
    let read = Checkpoint::load(&folder.path().join("residual")).unwrap();
    assert!(read.card.residual && read.digest() == checkpoint.digest());
}

#[test]
fn what_is_chance_or_within_its_error_is_not_offered() {
    for (wrench, words) in [
        (
            &(|_, chance| 5.0 * chance) as &dyn Fn(f64, f64) -> f64,
            "hardly better",
        ),
        (&|speed, _| 0.2 * speed, "does not stand out"),
    ] {
        let learned = learn(&missing(3, wrench));
        let LearnedResidual::NotOffered(why) = learned else {
            panic!("{learned:?}");
        };
        assert!(why.contains(words) && why.contains("offered"), "{why}");
    }
    let stopped = learn_residual(
        &missing(3, &|speed, _| speed),
        &AtomicBool::new(true),
        &|_, _| {},
    );
    assert!(matches!(stopped.unwrap(), LearnedResidual::Cancelled));
}
