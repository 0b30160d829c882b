//! The released checkpoints against the recorded runs of the truth: the wrench in open loop, and the distance in closed
//! loop.
//!
//! The recorded runs last 0.9 s, so the distances after 2 s that docs/experiments.md states cannot be measured here. The
//! distances below are what the released checkpoints give on these runs, by
//! `cargo test --test numerics released::closed -- --nocapture`.

use std::{collections::BTreeMap, path::Path};

use hydro_frames::base_from_world;
use hydro_model::{Outputs, checkpoint::Checkpoint};
use hydro_training::{
    InitialForce,
    dataset::{self, Manifest, Split, Trajectory},
    evaluate,
    rollouts::{Rollout, Rollouts},
};
use serde_json::Value;

/// A released checkpoint.
struct Released {
    name: &'static str,
    /// Runs of the water that it was trained in.
    rollouts: &'static str,
    /// Median distance from the truth at the end of these runs [m].
    #[cfg_attr(
        not(mujoco_plugins),
        expect(dead_code, reason = "closed runs need MuJoCo")
    )]
    distance: f64,
}

const RELEASED: [Released; 7] = [
    Released {
        name: "b1-relaxation",
        rollouts: "rollouts",
        distance: 0.0117,
    },
    Released {
        name: "b1-task2",
        rollouts: "rollouts",
        distance: 0.0191,
    },
    Released {
        name: "b1-strip",
        rollouts: "rollouts-strip",
        distance: 0.0291,
    },
    Released {
        name: "b1-strip-attention-ode",
        rollouts: "rollouts-strip",
        distance: 0.0439,
    },
    Released {
        name: "b1-strip-cnode",
        rollouts: "rollouts-strip",
        distance: 0.0348,
    },
    Released {
        name: "b1-strip-lstm",
        rollouts: "rollouts-strip",
        distance: 0.0412,
    },
    Released {
        name: "b1-strip-mlp-ode",
        rollouts: "rollouts-strip",
        distance: 0.0690,
    },
];
/// Allowed error here over the stated one.
const MARGIN: f64 = 1.5;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

impl Released {
    fn folder(&self) -> std::path::PathBuf {
        root().join("models").join(self.name)
    }

    fn recorded(&self) -> Rollouts {
        Rollouts::load(&root().join("tests/data").join(self.rollouts)).unwrap()
    }
}

/// The water's force at a sample, as the outputs have it: its wrench on the base, then its torques on the joints.
fn force(run: &Rollout, sample: usize, outputs: Outputs) -> Vec<f64> {
    if outputs == Outputs::Wrench {
        return run.wrench.row(sample).to_vec();
    }
    let (q, force) = (run.qpos.row(sample), run.generalised.as_ref().unwrap());
    let force = force.row(sample);
    let base = base_from_world([q[3], q[4], q[5], q[6]], [force[0], force[1], force[2]]);
    [&base[..], &force[3..]].concat()
}

/// The recorded runs as a split of the checkpoint's robot.
fn split(checkpoint: &Checkpoint, rollouts: &Rollouts) -> Split {
    let card = &checkpoint.card;
    assert_eq!(card.water, rollouts.index.water);
    let outputs = Outputs::of(&card.outputs);
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
        wrench: (0..run.time.len())
            .flat_map(|sample| single(&force(run, sample, outputs)))
            .collect(),
    });
    let folder = tempfile::tempdir().unwrap();
    let parts = [("test", trajectories.collect())];
    let data = dataset::write(folder.path(), &manifest, &parts).unwrap();
    data.split("test", None).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    serde_json::from_value(value.clone()).unwrap()
}

/// nRMSE over all outputs, as the card has it: RMSE over the standard deviation of the card's test split, which is the
/// card's `rmse` over its `nrmse`; the deviations of a few short runs are others.
#[test]
fn the_recorded_wrench_is_predicted_as_the_card_says() {
    for released in RELEASED {
        let (name, checkpoint) = (released.name, Checkpoint::load(&released.folder()).unwrap());
        let metrics = &checkpoint.card.metrics;
        assert_eq!(metrics["start"], "clean");
        let found = evaluate(
            &checkpoint,
            &split(&checkpoint, &released.recorded()),
            InitialForce::Clean,
        )
        .unwrap();
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
        for released in RELEASED {
            let (name, folder) = (released.name, released.folder());
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
            let runs = released.recorded().runs;
            let Ok(found) = closed_loop(&[method], &runs, &[DURATION], &|_| ());
            let row = &found.rows[0];
            let distance = row.position[0].median;
            let bound = MARGIN * released.distance;
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
