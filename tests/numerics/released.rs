//! The released checkpoints against the recorded runs of the truth: the wrench in open loop, and the distance in closed
//! loop.
//!
//! The three recorded runs last 0.9 s, so the distances after 2 s that docs/experiments.md states cannot be measured here. The
//! distances below are what the released checkpoints give on these runs, by
//! `cargo test --test numerics released::closed -- --nocapture`.

use std::{collections::BTreeMap, path::Path};

use hydro_model::checkpoint::Checkpoint;
use hydro_training::{
    InitialForce,
    dataset::{self, Manifest, Split, Trajectory},
    evaluate,
    rollouts::Rollouts,
};
use serde_json::Value;

/// Name of a released checkpoint, and its median distance from the truth at the end of the recorded runs [m].
const RELEASED: [(&str, f64); 2] = [("b1-relaxation", 0.0117), ("b1-task2", 0.0191)];
/// Allowed error here over the stated one.
const MARGIN: f64 = 1.5;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn recorded() -> Rollouts {
    Rollouts::load(&root().join("tests/data/rollouts")).unwrap()
}

/// The recorded runs as a split of the checkpoint's robot.
fn split(checkpoint: &Checkpoint) -> Split {
    let (rollouts, card) = (recorded(), &checkpoint.card);
    let features = &rollouts.index.features;
    assert_eq!(*features, card.features);
    let manifest = Manifest {
        schema: dataset::SCHEMA.to_owned(),
        name: "rollouts".to_owned(),
        features: features.clone(),
        feature_units: card.feature_units.clone(),
        outputs: card.outputs.clone(),
        output_units: card.output_units.clone(),
        frames: card.frames.clone(),
        sample_period: rollouts.index.sample_period,
        samples: rollouts.runs[0].time.len(),
        kinematics: None,
        generalised: None,
        water: None,
        added_mass: Vec::new(),
        splits: BTreeMap::new(),
        provenance: BTreeMap::new(),
    };
    let single = |row: &[f64]| row.iter().map(|value| *value as f32).collect::<Vec<_>>();
    let trajectories = rollouts.runs.iter().map(|run| Trajectory {
        x: run.x.rows().flat_map(single).collect(),
        wrench: run.wrench.rows().flat_map(single).collect(),
    });
    let folder = tempfile::tempdir().unwrap();
    let parts = [("test", trajectories.collect())];
    let data = dataset::write(folder.path(), &manifest, &parts).unwrap();
    data.split("test", None).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    serde_json::from_value(value.clone()).unwrap()
}

/// nRMSE over the six axes, as the card has it: RMSE over the standard deviation of the card's test split, which is the
/// card's `rmse` over its `nrmse`; the deviations of three short runs are others.
#[test]
fn the_recorded_wrench_is_predicted_as_the_card_says() {
    for (name, _) in RELEASED {
        let checkpoint = Checkpoint::load(&root().join("models").join(name)).unwrap();
        let metrics = &checkpoint.card.metrics;
        assert_eq!(metrics["start"], "clean");
        let found = evaluate(&checkpoint, &split(&checkpoint), InitialForce::Clean).unwrap();
        let scale = numbers(&metrics["rmse"])
            .into_iter()
            .zip(numbers(&metrics["nrmse"]))
            .map(|(rmse, nrmse)| rmse / nrmse);
        let rmse = &found.errors.rmse;
        let square: f64 = rmse
            .iter()
            .zip(scale)
            .map(|(e, std)| (e / std).powi(2))
            .sum();
        let error = (square / rmse.len() as f64).sqrt();
        let stated = metrics["pooled"].as_f64().unwrap();
        println!("{name}: nRMSE {error:.4}, stated {stated:.4}");
        assert!(
            error <= MARGIN * stated,
            "{name}: nRMSE {error:.4}, the card states {stated:.4}"
        );
    }
}

#[cfg(mujoco_plugins)]
mod closed {
    use hydro_plugin::mujoco::{
        scene::with_attribute,
        simulator::{Model, Swimmer},
    };
    use hydro_training::{
        comparison::{Method, Water, closed_loop},
        simulator::Simulator,
    };

    use super::*;

    /// Length of the recorded runs [s].
    const DURATION: f64 = 0.9;

    #[test]
    fn the_plugin_drives_the_robot_along_the_recorded_runs() {
        let scene = std::fs::read_to_string(root().join("mjcf/b1_swim.xml")).unwrap();
        for (name, stated) in RELEASED {
            let folder = root().join("models").join(name);
            let set = |scene: &str, key: &str, value: &str| {
                with_attribute(scene, "hydro.wrench", key, value).unwrap()
            };
            let scene = set(&scene, "checkpoint", folder.to_str().unwrap());
            let method = Method::<std::convert::Infallible> {
                name: name.to_owned(),
                simulator: Box::new(|run| {
                    let scene = set(&scene, "density", &run.density.to_string());
                    let model = Model::from_xml(&scene).unwrap();
                    Ok(Box::new(Swimmer::new(model).unwrap()) as Box<dyn Simulator>)
                }),
                water: Water::Scene,
            };
            let Ok(found) = closed_loop(&[method], &recorded().runs, &[DURATION], &|_| ());
            let row = &found.rows[0];
            let distance = row.position[0].median;
            let bound = MARGIN * stated;
            println!(
                "{name}: {distance:.4} m after {DURATION} s, at most {bound:.4}; {:?}",
                row.position_by_run
            );
            assert_eq!(row.diverged, 0, "{name}");
            assert!(
                distance <= bound,
                "{name}: {distance:.4} m after {DURATION} s, expected at most {bound:.4}"
            );
        }
    }
}
