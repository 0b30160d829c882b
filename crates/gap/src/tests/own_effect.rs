//! An effect of the user's own is fitted and named as one of the catalogue is, its memory carried along.

use std::{cell::Cell, sync::atomic::AtomicBool};

use hydro_effects::own::register_toml;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{fake::RigidBody, pushed, settings};
use crate::{
    likelihood::{explain::explain, followed::Followed},
    problem::problem::Problem,
    progress::Watch,
    stage::name::name,
};

/// A winch that follows the hull late.
const WINCH: &str = r#"
summary = "a winch that hauls the hull back to where it was a moment ago"
target = "body"
[parameters.stiffness]
unit = "N/m"
lower = 0
upper = 100
prior_sd = 5
[parameters.delay]
unit = "s"
null = 1
lower = 0.1
upper = 10
prior_sd = 0.5
[memory]
input = "x"
time_constant = "delay"
[world_force]
x = "-stiffness * (x - memory)"
"#;

/// The truth is another code with another step rule for the memory.
#[test]
fn it_is_named_with_its_values() {
    let winch = register_toml("winch", WINCH).unwrap();
    let (stiffness, delay) = (12.0, 1.3);
    let trials = (0..4).map(|seed| {
        let followed = Cell::new(0.0);
        let push = move |qpos: &[f64], _: &[f64]| {
            let force = -stiffness * (qpos[0] - followed.get());
            let slope = (qpos[0] - followed.get()) / delay;
            followed.set(followed.get() + 0.005 * slope);
            let attitude = Quaternion::new(qpos[3], qpos[4], qpos[5], qpos[6]);
            let turned =
                UnitQuaternion::from_quaternion(attitude).inverse() * Vector3::new(force, 0.0, 0.0);
            [turned.x, turned.y, turned.z, 0.0, 0.0, 0.0]
        };
        pushed(
            &format!("trial {seed}"),
            &[],
            &[0.02, -0.02],
            seed,
            1.0,
            &push,
        )
    });
    let plant = RigidBody::new();
    let stop = AtomicBool::new(false);
    let watch = Watch::silent(&stop);
    let settings = crate::Settings {
        own_effects: vec![winch],
        ..settings()
    };
    let problem = Problem::prepare(&plant, trials.collect(), settings, &watch).unwrap();
    let followed = Followed::new(&problem, &watch).unwrap();
    let explanation = explain(&followed, &watch).unwrap();
    let naming = name(&explanation, &watch).unwrap();
    let chosen: Vec<_> = naming.named.chosen.iter().map(|of| of.effect).collect();
    assert_eq!(chosen, [winch], "{:#?}", naming.named.effects);
    let found = |name: &str| {
        let all = &naming.named.chosen[0].parameters;
        all.iter().find(|of| of.name == name).unwrap().clone()
    };
    for (name, unit, truth) in [("stiffness", "N/m", stiffness), ("delay", "s", delay)] {
        let fitted = found(name);
        assert_eq!(fitted.unit, unit);
        let [low, high] = fitted.ci95;
        assert!(low < truth && truth < high, "{name}: {low} to {high}");
        assert!(
            (fitted.value - truth).abs() < 0.2 * truth,
            "{name} {}",
            fitted.value
        );
    }
}
