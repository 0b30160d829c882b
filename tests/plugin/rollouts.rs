//! Recorded rollouts of B1, replayed through the plugin inside `mj_step`.
#![cfg(mujoco_plugins)]

use std::{fs, path::Path, sync::Arc};

use crate::reference::Reference;
use hydro_frames as frames;
use hydro_model::EngineKind;
use hydro_plugin::{
    mujoco::{
        scene::with_attribute,
        simulator::{Data, Integrator, Model, Swimmer},
    },
    plugin::FeatureMap,
};
use hydro_training::rollouts::{Rollout, Rollouts};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn recorded() -> Rollouts {
    Rollouts::load(&root().join("tests/data/rollouts")).unwrap()
}

fn truth() -> String {
    fs::read_to_string(root().join("mjcf/b1_truth.xml")).unwrap()
}

/// The truth scene with the plugin on the trunk and its wrench as a sensor.
fn truth_with_plugin(checkpoint: &Path, density: f64, engine: &str) -> String {
    let checkpoint = checkpoint.display();
    let extension = format!(
        "<extension><plugin plugin=\"hydro.wrench\"><instance name=\"learned\">\
         <config key=\"checkpoint\" value=\"{checkpoint}\"/><config key=\"density\" value=\"{density:?}\"/>\
         <config key=\"engine\" value=\"{engine}\"/></instance></plugin></extension><worldbody>"
    );
    let carried =
        "<freejoint name=\"base\"/><plugin plugin=\"hydro.wrench\" instance=\"learned\"/>";
    let sensor = "<plugin name=\"learned\" plugin=\"hydro.wrench\" instance=\"learned\"/></sensor>";
    truth()
        .replacen("<worldbody>", &extension, 1)
        .replacen("<freejoint name=\"base\"/>", carried, 1)
        .replacen("</sensor>", sensor, 1)
}

fn b1_checkpoint(folder: &Path) -> std::path::PathBuf {
    let joints = recorded().index.joints;
    let joints: Vec<&str> = joints.iter().map(String::as_str).collect();
    let mut recipe = crate::common::lively(&joints);
    recipe.mean = vec![10.0, 5.0, 30.0, 1.0, 2.0, 3.0];
    recipe.deviation = vec![60.0, 40.0, 80.0, 8.0, 12.0, 9.0];
    recipe.save(folder, "b1")
}

#[test]
fn features_computed_here_are_the_recorded_ones() {
    let rollouts = recorded();
    let model = Model::load(&root().join(&rollouts.index.model)).unwrap();
    let body = model.describe(model.body("trunk").unwrap());
    for run in &rollouts.runs {
        let layout = &rollouts.index.features;
        let map = FeatureMap::new(
            layout,
            &rollouts.index.joints,
            None,
            &body,
            run.density,
            [0.0; 3],
        )
        .unwrap();
        let mut previous: Option<Vec<f64>> = None;
        for (k, want) in run.x.rows().enumerate() {
            let mut x = vec![0.0; layout.len()];
            map.sample(
                run.qpos.row(k),
                run.qvel.row(k),
                [0.0; 3],
                previous.as_deref(),
                &mut x,
            );
            for ((got, want), feature) in x.iter().zip(want).zip(layout.features()) {
                assert!(
                    (got - want).abs() < 1e-9,
                    "{} row {k} {feature}: {got} {want}",
                    run.name
                );
            }
            previous = Some(x);
        }
    }
}

/// Steps the truth with the plugin's wrench cancelled, so that the motion is the recorded one, and calls
/// `at_sample` with the plugin's reading at every recorded row.
fn replay(
    run: &Rollout,
    xml: &str,
    steps_a_sample: usize,
    mut at_sample: impl FnMut(usize, &Data, &[f64]),
) {
    let mut model = Model::from_xml(xml).unwrap();
    model.set_density(run.density).unwrap();
    model.set_integrator(Integrator::Euler);
    let trunk = model.body("trunk").unwrap();
    let reading = model.sensor("learned").unwrap();
    let mut data = Data::new(&Arc::new(model)).unwrap();
    data.qpos_mut().copy_from_slice(run.qpos.row(0));
    data.qvel_mut().copy_from_slice(run.qvel.row(0));
    data.set_time(run.time[0]);
    for k in 0..run.x.len() {
        data.forward();
        at_sample(k, &data, &data.sensordata()[reading.clone()]);
        if k == run.ctrl.len() {
            break;
        }
        data.ctrl_mut().copy_from_slice(run.ctrl.row(k));
        data.xfrc_applied_mut()[6 * trunk..6 * trunk + 6].copy_from_slice(run.push.row(k));
        for _ in 0..steps_a_sample {
            data.forward();
            let wrench: Vec<f64> = data.sensordata()[reading.clone()].to_vec();
            let q = data.qpos();
            let force =
                frames::to_world([q[3], q[4], q[5], q[6]], [wrench[0], wrench[1], wrench[2]]);
            for (cancel, value) in data
                .qfrc_applied_mut()
                .iter_mut()
                .zip(force.iter().chain(&wrench[3..]))
            {
                *cancel = -value;
            }
            data.step();
        }
    }
}

#[test]
fn the_wrench_inside_a_step_is_the_model_on_the_recorded_features() {
    let folder = tempfile::tempdir().unwrap();
    let path = b1_checkpoint(folder.path());
    let checkpoint = hydro_model::checkpoint::Checkpoint::load(&path).unwrap();
    for kind in EngineKind::ALL {
        let engine = kind.to_string();
        for run in &recorded().runs {
            let mut want = Reference::new(&checkpoint, kind, run.time[0], run.x.row(0));
            let (mut pairs, mut drift) = (Vec::new(), 0.0_f64);
            replay(
                run,
                &truth_with_plugin(&path, run.density, &engine),
                5,
                |k, data, got| {
                    if k > 0 {
                        want.sample(run.time[k], run.x.row(k));
                    }
                    for (a, b) in data.qpos().iter().zip(run.qpos.row(k)) {
                        drift = drift.max((a - b).abs());
                    }
                    pairs.push((got.to_vec(), want.force(run.time[k])));
                },
            );
            assert!(
                drift < 1e-7,
                "the replay left the recorded motion by {drift}"
            );
            for axis in 0..6 {
                let rms = (pairs
                    .iter()
                    .map(|(_, want)| want[axis].powi(2))
                    .sum::<f64>()
                    / pairs.len() as f64)
                    .sqrt();
                let spread = pairs
                    .iter()
                    .map(|(_, want)| want[axis])
                    .fold((f64::MAX, f64::MIN), |(low, high), value| {
                        (low.min(value), high.max(value))
                    });
                assert!(
                    spread.1 - spread.0 > 0.01 * rms,
                    "axis {axis} hardly moves: {spread:?}, rms {rms}"
                );
                for (k, (got, want)) in pairs.iter().enumerate() {
                    let error = (got[axis] - want[axis]).abs() / rms;
                    assert!(
                        error < 1e-5,
                        "{engine} {} axis {axis} row {k}: {error:e} of its rms",
                        run.name
                    );
                }
            }
        }
    }
}

#[test]
fn a_rollout_goes_on_bit_for_bit_from_a_copy_and_from_a_saved_state() {
    let folder = tempfile::tempdir().unwrap();
    let path = b1_checkpoint(folder.path());
    let run = &recorded().runs[0];
    let model = Arc::new(Model::from_xml(&truth_with_plugin(&path, run.density, "fused")).unwrap());
    let drive = |data: &mut Data, from: usize, to: usize| {
        let mut trace = Vec::new();
        for step in from..to {
            data.ctrl_mut().copy_from_slice(run.ctrl.row(step / 5));
            data.step();
            trace.extend(
                [
                    data.qpos(),
                    data.qvel(),
                    data.sensordata(),
                    data.plugin_state(),
                ]
                .concat(),
            );
        }
        trace.into_iter().map(f64::to_bits).collect::<Vec<u64>>()
    };
    let mut data = Data::new(&model).unwrap();
    data.qpos_mut().copy_from_slice(run.qpos.row(0));
    data.qvel_mut().copy_from_slice(run.qvel.row(0));
    drive(&mut data, 0, 123);
    let (mut copy, saved) = (data.try_clone().unwrap(), data.state());
    let want = drive(&mut data, 123, 300);
    assert_eq!(drive(&mut copy, 123, 300), want);
    data.set_state(&saved).unwrap();
    assert_eq!(drive(&mut data, 123, 300), want);
    let mut fresh = Data::new(&model).unwrap();
    fresh.set_state(&saved).unwrap();
    assert_eq!(drive(&mut fresh, 123, 300), want);
    // A state that is another's would not pass unseen.
    assert!(fresh.set_state(&saved[1..]).is_err());
}

/// In strip water whose added mass is in the inertia, a run's wrench is what the passive stage holds: the label, and the
/// gyroscopic part of the added mass, which the plugin makes of the card's matrices.
#[test]
fn the_gyroscopic_part_of_a_recorded_run_is_the_plugin_s() {
    let rollouts = Rollouts::load(&root().join("tests/data/rollouts-strip")).unwrap();
    let joints: Vec<&str> = rollouts.index.joints.iter().map(String::as_str).collect();
    let mut recipe = crate::common::lively(&joints);
    recipe.mean = vec![0.0; 6];
    recipe.deviation = vec![1e-13; 6];
    recipe.added_mass = rollouts.index.added_mass.clone();
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = recipe.save(folder.path(), "silent");
    let mut greatest = 0.0_f64;
    for run in &rollouts.runs {
        let mut scene = fs::read_to_string(root().join("mjcf/b1_swim.xml")).unwrap();
        for (key, value) in [
            ("checkpoint", checkpoint.display().to_string()),
            ("density", run.density.to_string()),
        ] {
            scene = with_attribute(&scene, "hydro.wrench", key, &value).unwrap();
        }
        let mut robot = Swimmer::new(Model::from_xml(&scene).unwrap()).unwrap();
        let label = run.generalised.as_ref().unwrap();
        for k in (0..run.x.len()).step_by(10) {
            let (q, force) = (run.qpos.row(k), label.row(k));
            let attitude = [q[3], q[4], q[5], q[6]];
            let base = frames::base_from_world(attitude, [force[0], force[1], force[2]]);
            let found = robot.passive_wrench_at(q, run.qvel.row(k)).to_array();
            let label = base.iter().chain(&force[3..6]);
            for ((found, whole), label) in found.iter().zip(run.wrench.row(k)).zip(label) {
                assert!(
                    (found - (whole - label)).abs() < 1e-6,
                    "{}: {found}",
                    run.name
                );
                greatest = greatest.max(found.abs());
            }
        }
    }
    assert!(greatest > 0.1, "{greatest} N");
}
