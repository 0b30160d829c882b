//! One small scene, the same force whichever way the library acts: as an engine plugin, or as the
//! passive callback of MuJoCo 2.2.2 (`MUJOCO_DIR=/usr cargo test --target-dir target/debian`).
#![cfg(feature = "mujoco")]

use std::{path::Path, sync::Arc};

use crate::common::Asks;
use crate::reference::Reference;
use hydro_frames as frames;
use hydro_model::{Encoding, EngineKind, ModelConfig, checkpoint::Checkpoint, envelope::Envelope};
use hydro_plugin::{
    mujoco::simulator::{Data, Model, SimulatorError},
    plugin::{FeatureMap, learned_wrench},
};

/// Memory of the test checkpoint in an engine.
fn memory_in(checkpoint: &Checkpoint, kind: EngineKind) -> usize {
    learned_wrench::state_len(&*checkpoint.engine(kind, None).unwrap())
}

/// Memory of the test checkpoint in the engine that is the default.
#[cfg(not(mujoco_plugins))]
fn memory(checkpoint: &Checkpoint) -> usize {
    memory_in(checkpoint, EngineKind::default())
}

fn asks(checkpoint: &Checkpoint) -> Asks {
    if cfg!(mujoco_plugins) {
        Asks::Plugin
    } else {
        Asks::Custom {
            // Enough for any engine.
            userdata: EngineKind::ALL
                .into_iter()
                .map(|kind| memory_in(checkpoint, kind))
                .max()
                .unwrap(),
        }
    }
}

fn scene(path: &Path, more: &[(&str, &str)], integrator: &str) -> Result<Data, SimulatorError> {
    stepped_scene(path, more, integrator, 0.002)
}

fn stepped_scene(
    path: &Path,
    more: &[(&str, &str)],
    integrator: &str,
    timestep: f64,
) -> Result<Data, SimulatorError> {
    let checkpoint = Checkpoint::load(path).unwrap();
    let path = path.display().to_string();
    let mut attributes = vec![("checkpoint", path.as_str())];
    if !cfg!(mujoco_plugins) {
        attributes.push(("body", "hull"));
    }
    attributes.extend(more);
    let mut model = Model::from_xml(&crate::common::fish(
        &asks(&checkpoint),
        &attributes,
        integrator,
    ))?;
    model.set_timestep(timestep);
    let mut data = Data::new(&Arc::new(model))?;
    data.qpos_mut()[3..7].copy_from_slice(&[0.5, -0.5, 0.5, 0.5]);
    data.qvel_mut()
        .copy_from_slice(&[0.3, -0.2, 0.1, 0.4, -0.3, 0.2, 1.0]);
    data.ctrl_mut()[0] = 0.2;
    Ok(data)
}

/// The passive force of the step that was just taken, in the base frame of its start.
fn wrench(data: &Data, attitude: [f64; 4]) -> [f64; 6] {
    let passive = data.qfrc_passive();
    let [x, y, z] = frames::base_from_world(attitude, [passive[0], passive[1], passive[2]]);
    [x, y, z, passive[3], passive[4], passive[5]]
}

/// Positions and velocities after 100 steps of [`scene`] with the test checkpoint, computed by MuJoCo
/// 4.0.0 with the engine plugin (a failure prints the new ones).
const AFTER_100_STEPS: [f64; 15] = [
    0.057738693567,
    -0.034175425476,
    0.018214610335,
    0.533473322677,
    -0.445312506106,
    0.519411998116,
    0.497306909374,
    0.311528335294,
    0.279264107152,
    -0.140952007648,
    0.084655959173,
    0.685818334048,
    -0.355986978760,
    0.219492085551,
    1.807973046801,
];

/// 100 steps of [`scene`], held to a reference beside it; the scene after them.
fn followed(path: &Path, kind: EngineKind) -> Data {
    let checkpoint = Checkpoint::load(path).unwrap();
    let engine = kind.to_string();
    let mut data = scene(path, &[("engine", &engine)], "Euler").unwrap();
    let body = data.model().describe(data.model().body("hull").unwrap());
    let card = &checkpoint.card;
    let map = FeatureMap::new(&card.features, &card.joints, None, &body, 1000.0, [0.0; 3]).unwrap();
    let mut x = vec![0.0; map.len()];
    map.sample(data.qpos(), data.qvel(), [0.0; 3], None, &mut x);
    let mut reference = Reference::new(&checkpoint, kind, 0.0, &x);
    let (mut least, mut most) = (f64::MAX, f64::MIN);
    for step in 0..100 {
        let time = data.time();
        if step > 0 && step % 5 == 0 {
            let previous = x.clone();
            map.sample(data.qpos(), data.qvel(), [0.0; 3], Some(&previous), &mut x);
            reference.sample(time, &x);
        }
        let q = data.qpos();
        let attitude = [q[3], q[4], q[5], q[6]];
        data.step();
        let found = wrench(&data, attitude);
        for (got, want) in found.iter().zip(reference.force(time)) {
            let place = format!("{} {kind} step {step}", card.model.kind());
            assert!((got - want).abs() < 1e-9, "{place}: {got} {want}");
        }
        (least, most) = (least.min(found[0]), most.max(found[0]));
    }
    assert!(
        most - least > 1e-3,
        "{}: the force stands still",
        card.model.kind()
    );
    data
}

#[test]
fn the_force_is_the_networks_and_the_same_in_every_release() {
    let folder = tempfile::tempdir().unwrap();
    let path = crate::common::lively(&["fin"]).save(folder.path(), "lively");
    let data = followed(&path, EngineKind::Fused);
    let end: Vec<f64> = data.qpos().iter().chain(data.qvel()).copied().collect();
    for (got, want) in end.iter().zip(AFTER_100_STEPS) {
        assert!((got - want).abs() < 1e-6, "{end:?}");
    }
}

#[test]
fn every_kind_of_model_acts_in_the_scene_in_every_engine() {
    let folder = tempfile::tempdir().unwrap();
    for (number, recipe) in crate::common::zoo(&["fin"]).iter().enumerate() {
        let path = recipe.save(folder.path(), &number.to_string());
        for kind in EngineKind::ALL {
            followed(&path, kind);
        }
    }
}

/// Thrown in at many times what its network knows, and driven on by it; with and without the range of its training in the
/// card.
#[test]
fn a_robot_faster_than_its_training_is_braked_back_into_it() {
    let root = tempfile::tempdir().unwrap();
    let driving = crate::common::Recipe {
        mean: vec![30.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..crate::common::lively(&["fin"])
    };
    let bare = driving.checkpoint();
    let mut held = bare.clone();
    let features = bare.card.features.len();
    held.card.envelope = Some(Envelope {
        least: vec![-0.5; features],
        most: vec![0.5; features],
        least_force: vec![-5.0; 6],
        most_force: vec![5.0; 6],
    });
    let speeds_after = |checkpoint: &Checkpoint, name: &str| {
        let path = root.path().join(name);
        checkpoint.save(&path).unwrap();
        let mut data = scene(&path, &[], "Euler").unwrap();
        data.qvel_mut()[..6].copy_from_slice(&[8.0, -5.0, 3.0, 6.0, -4.0, 9.0]);
        for _ in 0..5000 {
            data.step();
        }
        let norm = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        (norm(&data.qvel()[..3]), norm(&data.qvel()[3..6]))
    };
    let (speed, rate) = speeds_after(&held, "held");
    // Twice the range along every axis.
    let most = 2.0 * 0.5 * 3f64.sqrt();
    assert!(speed < most && rate < most, "{speed} m/s, {rate} rad/s");
    let (speed, _) = speeds_after(&bare, "bare");
    assert!(speed > 2.0 * most, "the network alone: {speed} m/s");
}

/// A body that turns over and over: its quaternion is continuous in the features, whatever sign MuJoCo gives it and
/// whatever the engine remembers, at samples and between them.
#[test]
fn a_turning_body_keeps_its_quaternions_sign_in_every_engine() {
    let folder = tempfile::tempdir().unwrap();
    for encoding in [Encoding::Raw, Encoding::Up] {
        let mut recipe = crate::common::lively(&["fin"]);
        let ModelConfig::AttentionOde(config) = &mut recipe.model else {
            unreachable!("the recipe's model has memory");
        };
        config.encoding = encoding.clone();
        let path = recipe.save(folder.path(), &format!("{encoding:?}"));
        let checkpoint = Checkpoint::load(&path).unwrap();
        let card = &checkpoint.card;
        for (kind, timestep) in EngineKind::ALL
            .into_iter()
            .flat_map(|kind| [(kind, 0.002), (kind, 0.003)])
        {
            let engine = kind.to_string();
            let mut data = stepped_scene(&path, &[("engine", &engine)], "Euler", timestep).unwrap();
            data.qvel_mut()[3..6].copy_from_slice(&[4.0, -3.0, 5.0]);
            let body = data.model().describe(data.model().body("hull").unwrap());
            let map = FeatureMap::new(&card.features, &card.joints, None, &body, 1000.0, [0.0; 3]);
            let map = map.unwrap();
            let quaternion = card.features.quaternion().unwrap();
            let mut x = vec![0.0; map.len()];
            map.sample(data.qpos(), data.qvel(), [0.0; 3], None, &mut x);
            let mut reference = Reference::new(&checkpoint, kind, 0.0, &x);
            let (mut samples, mut least) = (0, f64::MAX);
            for step in 0..1000 {
                let (began, previous) = (data.time(), x.clone());
                let q = data.qpos();
                let attitude = [q[3], q[4], q[5], q[6]];
                data.step();
                for (got, want) in wrench(&data, attitude).iter().zip(reference.force(began)) {
                    assert!(
                        (got - want).abs() < 1e-7,
                        "{encoding:?} {kind} step {step}: {got} {want}"
                    );
                }
                map.sample(data.qpos(), data.qvel(), [0.0; 3], Some(&previous), &mut x);
                least = least.min(x[quaternion]);
                let due = f64::from(samples + 1) * card.sample_period;
                if data.time() > due - 1e-9 {
                    let mut between = vec![0.0; map.len()];
                    let fraction = ((due - began) / (data.time() - began)).min(1.0);
                    map.between(&previous, &x, fraction, &mut between);
                    reference.sample(due, &between);
                    samples += 1;
                }
            }
            assert!(
                least < -0.3,
                "the quaternion's sign was never put to the test: {least}"
            );
        }
    }
}

#[test]
fn a_reset_is_a_fresh_start() {
    let folder = tempfile::tempdir().unwrap();
    let path = crate::common::lively(&["fin"]).save(folder.path(), "lively");
    let mut data = scene(&path, &[], "Euler").unwrap();
    let (qpos, qvel) = (data.qpos().to_vec(), data.qvel().to_vec());
    let mut run = || {
        data.reset();
        data.qpos_mut().copy_from_slice(&qpos);
        data.qvel_mut().copy_from_slice(&qvel);
        for _ in 0..37 {
            data.step();
        }
        data.qpos()
            .iter()
            .map(|value| value.to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[cfg(not(mujoco_plugins))]
mod callback {
    use super::*;

    #[expect(clippy::print_stderr, reason = "a skipped test says so")]
    fn skip(reason: &str) {
        eprintln!("skipped: {reason}");
    }

    /// A refused scene applies no force, whatever it did before.
    fn is_inert(mut data: Data) -> bool {
        data.step();
        data.qfrc_passive()[..6].iter().all(|value| *value == 0.0)
    }

    #[test]
    fn a_scene_that_asks_wrongly_gets_no_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = crate::common::lively(&["fin"]).save(folder.path(), "lively");
        assert!(!is_inert(scene(&path, &[], "Euler").unwrap()));
        assert!(is_inert(scene(&path, &[], "RK4").unwrap()));
        assert!(is_inert(
            scene(&path, &[("density", "-1")], "Euler").unwrap()
        ));
        let checkpoint = Checkpoint::load(&path).unwrap();
        let text = path.display().to_string();
        let short = Asks::Custom {
            userdata: memory(&checkpoint) - 1,
        };
        let small =
            crate::common::fish(&short, &[("checkpoint", &text), ("body", "hull")], "Euler");
        assert!(is_inert(
            Data::new(&Arc::new(Model::from_xml(&small).unwrap())).unwrap()
        ));
        let nobody = crate::common::fish(
            &asks(&checkpoint),
            &[("checkpoint", &text), ("body", "shark")],
            "Euler",
        );
        assert!(is_inert(
            Data::new(&Arc::new(Model::from_xml(&nobody).unwrap())).unwrap()
        ));
    }

    /// The program that Debian ships, with the library preloaded.
    #[test]
    fn testspeed_with_the_library_preloaded() {
        let program = Path::new("/usr/bin/mujoco-testspeed");
        if !program.exists() {
            return skip("no mujoco-testspeed (apt-get install libmujoco-samples)");
        }
        let folder = tempfile::tempdir().unwrap();
        let path = crate::common::lively(&["fin"]).save(folder.path(), "lively");
        let checkpoint = Checkpoint::load(&path).unwrap();
        let text = path.display().to_string();
        let run = |userdata: usize, integrator: &str| {
            let scene = crate::common::fish(
                &Asks::Custom { userdata },
                &[("checkpoint", &text), ("body", "hull")],
                integrator,
            );
            let file = folder.path().join("fish.xml");
            std::fs::write(&file, scene).unwrap();
            let library = std::env::current_exe()
                .unwrap()
                .with_file_name("libhydro_plugin.so");
            let done = std::process::Command::new(program)
                .arg(&file)
                .arg("2000")
                .env("LD_PRELOAD", library)
                .current_dir(folder.path())
                .output()
                .unwrap();
            assert!(done.status.success(), "{done:?}");
            format!(
                "{}{}",
                String::from_utf8_lossy(&done.stdout),
                String::from_utf8_lossy(&done.stderr)
            )
        };
        let needed = memory(&checkpoint);
        let fine = run(needed, "Euler");
        assert!(
            fine.contains("Steps per second") && !fine.contains("hydro"),
            "{fine}"
        );
        let short = run(needed - 1, "Euler");
        assert!(
            short.contains(&format!("nuserdata=\"{needed}\"")),
            "{short}"
        );
        let stages = run(needed, "RK4");
        assert!(
            stages.contains("integrator RK4 needs the engine plugin"),
            "{stages}"
        );
    }
}
