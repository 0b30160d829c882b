//! Checkpoints that act on the joints too, and cards that leave the added mass to the inertia.
#![cfg(feature = "mujoco")]

use std::{path::Path, sync::Arc};

#[cfg(not(mujoco_plugins))]
use hydro_model::checkpoint::Checkpoint;
use hydro_model::water::BodyAddedMass;
use hydro_plugin::mujoco::simulator::{Data, Model, SimulatorError};

#[cfg(mujoco_plugins)]
use crate::common::constant;
use crate::common::{Asks, CONSTANT, FIN_TORQUE, Recipe, constant_with_fin, fish};

/// Damping of the fin in the scene [N m s/rad].
const DAMPING: f64 = 0.1;

fn scene(checkpoint: &Path, more: &[(&str, &str)]) -> Result<Data, SimulatorError> {
    let path = checkpoint.display().to_string();
    let mut attributes = vec![("checkpoint", path.as_str())];
    #[cfg(mujoco_plugins)]
    let asks = Asks::Plugin;
    #[cfg(not(mujoco_plugins))]
    let asks = {
        let engine = Checkpoint::load(checkpoint)
            .unwrap()
            .engine(Default::default(), None);
        attributes.push(("body", "hull"));
        Asks::Custom {
            userdata: hydro_plugin::plugin::learned_wrench::state_len(&*engine.unwrap()),
        }
    };
    attributes.extend(more);
    let mut data = Data::new(&Arc::new(Model::from_xml(&fish(
        &asks,
        &attributes,
        "Euler",
    ))?))?;
    data.qvel_mut()
        .copy_from_slice(&[0.3, -0.2, 0.1, 0.4, -0.3, 0.2, 1.0]);
    Ok(data)
}

fn saved(recipe: &Recipe) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = recipe.save(folder.path(), "model");
    (folder, path)
}

/// Base wrench and fin torque of the checkpoint in a step; at the identity attitude world and base are one.
fn force(data: &mut Data) -> [f64; 7] {
    data.forward();
    let mut force = [0.0; 7];
    force.copy_from_slice(data.qfrc_passive());
    force[6] += DAMPING * data.qvel()[6];
    force
}

fn near(found: &[f64], expected: &[f64]) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
}

#[test]
fn a_torque_on_a_joint_is_a_passive_force_there() {
    let (_folder, path) = saved(&constant_with_fin());
    let mut all = scene(&path, &[]).unwrap();
    let found = force(&mut all);
    near(&found[..6], &CONSTANT);
    near(&found[6..], &[FIN_TORQUE]);
    // Between the samples and after them too.
    for _ in 0..7 {
        all.step();
        near(&force(&mut all)[6..], &[FIN_TORQUE]);
    }
}

#[test]
fn attribute_outputs_chooses_what_acts() {
    let (_folder, path) = saved(&constant_with_fin());
    let found = force(&mut scene(&path, &[("outputs", "wrench")]).unwrap());
    near(&found[..6], &CONSTANT);
    near(&found[6..], &[0.0]);
    let found = force(&mut scene(&path, &[("outputs", "generalised")]).unwrap());
    near(&found[6..], &[FIN_TORQUE]);
}

/// The message of a model that must not load.
#[cfg(mujoco_plugins)]
fn refusal(checkpoint: &Path, more: &[(&str, &str)]) -> String {
    let text = scene(checkpoint, more).unwrap_err().to_string();
    assert!(text.lines().count() <= 3, "{text}");
    text
}

#[cfg(mujoco_plugins)]
#[test]
fn outputs_that_the_robot_or_the_card_lacks_are_refused() {
    let (_folder, base) = saved(&constant());
    let text = refusal(&base, &[("outputs", "generalised")]);
    assert!(text.contains("on the base alone (force.x, "), "{text}");
    let text = refusal(&base, &[("outputs", "joints")]);
    assert!(
        text.contains("`joints`") && text.contains("`wrench` or `generalised`"),
        "{text}"
    );

    let mut recipe = constant_with_fin();
    recipe.outputs[6] = "joint_torque.rudder";
    let (_folder, other) = saved(&recipe);
    let text = refusal(&other, &[]);
    assert!(
        text.contains("`rudder`") && text.contains("its joints are: "),
        "{text}"
    );
    assert!(text.contains("fin"), "{text}");
}

/// 8 kg in heave and some of it coupled to the pitch, over the density of fresh water.
fn heavy(body: &str) -> BodyAddedMass {
    let mut matrix = vec![0.0; 36];
    for (at, value) in [
        (0, 1.0),
        (7, 4.0),
        (14, 8.0),
        (28, 0.5),
        (35, 0.4),
        (16, -0.6),
        (26, -0.6),
    ] {
        matrix[at] = value / 1000.0;
    }
    BodyAddedMass {
        body: body.to_owned(),
        matrix,
    }
}

/// A passive callback cannot change the inertia: the refusal is a warning, and no force acts.
#[cfg(not(mujoco_plugins))]
#[test]
fn an_added_mass_in_the_inertia_needs_the_engine_plugin() {
    let mut recipe = constant_with_fin();
    recipe.added_mass = vec![heavy("hull")];
    let (_folder, card) = saved(&recipe);
    near(&force(&mut scene(&card, &[]).unwrap()), &[0.0; 7]);
}

#[cfg(mujoco_plugins)]
#[test]
fn the_added_mass_of_a_card_is_the_effect_of_that_matrix() {
    let density = 1025.0;
    let (_folder, plain) = saved(&constant_with_fin());
    let mut recipe = constant_with_fin();
    recipe.added_mass = vec![heavy("hull"), heavy("fin")];
    let (_folder, card) = saved(&recipe);

    let entries = ["hull", "fin"].map(|body| {
        let matrix: Vec<f64> = heavy(body)
            .matrix
            .iter()
            .map(|value| value * density)
            .collect();
        let rows: Vec<&[f64]> = matrix.chunks(6).collect();
        serde_json::json!({"effect": "added_mass", "target": body,
            "parameters": {"matrix": rows, "point": [0.0, 0.0, 0.0]}})
    });
    let effects = serde_json::json!({"schema": "hydro-effects/1", "effects": entries}).to_string();
    let effects = effects.replace('"', "&quot;");
    let water = ("density", "1025");
    let mut by_hand = scene(&plain, &[water, ("effects", &effects)]).unwrap();
    let mut by_card = scene(&card, &[water]).unwrap();
    let mut without = scene(&plain, &[water]).unwrap();
    for _ in 0..50 {
        by_hand.step();
        by_card.step();
        without.step();
    }
    near(by_card.qvel(), by_hand.qvel());
    let apart = (by_card.qvel()[2] - without.qvel()[2]).abs();
    assert!(apart > 1e-3, "the added mass does not act: {apart}");
}

#[cfg(mujoco_plugins)]
#[test]
fn an_added_mass_that_the_model_cannot_have_is_refused() {
    let mut recipe = constant();
    recipe.added_mass = vec![heavy("keel")];
    let (_folder, card) = saved(&recipe);
    let text = refusal(&card, &[]);
    assert!(
        text.contains("added mass of the checkpoint's card"),
        "{text}"
    );
    assert!(text.contains("`keel`") && text.contains("hull"), "{text}");

    recipe.added_mass = vec![heavy("hull")];
    let (_folder, card) = saved(&recipe);
    let effects = "{&quot;schema&quot;:&quot;hydro-effects/1&quot;,&quot;effects&quot;:[{&quot;effect&quot;:&quot;added_mass&quot;,\
                   &quot;target&quot;:&quot;hull&quot;,&quot;parameters&quot;:{&quot;surge&quot;:1,&quot;sway&quot;:1,\
                   &quot;heave&quot;:1,&quot;roll&quot;:0,&quot;pitch&quot;:0,&quot;yaw&quot;:0}}]}";
    let text = refusal(&card, &[("effects", effects)]);
    assert!(
        text.contains("added mass of the checkpoint's card") && text.contains("hull"),
        "{text}"
    );
}
