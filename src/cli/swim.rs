//! The swim scene with a checkpoint in its plugin.

use std::path::Path;

use anyhow::Context as _;
use hydro_model::{EngineKind, Outputs};
use hydro_plugin::mujoco::{
    scene::with_attribute,
    simulator::{Model, Swimmer},
};
use hydro_training::comparison::{Method, Water};

/// Times at which closed-loop errors are evaluated [s].
pub(super) const HORIZONS: [f64; 3] = [1.0, 2.0, 4.0];

/// A method that swims in `scene` (the text of b1_swim.xml) under a checkpoint, of which these outputs act (all of the card's
/// where none are named).
pub(super) fn in_plugin<'a>(
    name: &str,
    checkpoint: &Path,
    engine: EngineKind,
    outputs: Option<Outputs>,
    scene: &str,
) -> anyhow::Result<Method<'a, anyhow::Error>> {
    let folder = checkpoint
        .canonicalize()
        .with_context(|| format!("checkpoint {}", checkpoint.display()))?;
    let scene = with_attribute(
        scene,
        "hydro.wrench",
        "checkpoint",
        &folder.to_string_lossy(),
    )?;
    let scene = with_attribute(&scene, "hydro.wrench", "engine", &engine.to_string())?;
    let scene = match outputs {
        Some(outputs) => with_attribute(&scene, "hydro.wrench", "outputs", &outputs.to_string())?,
        None => scene,
    };
    Ok(Method {
        name: name.to_owned(),
        simulator: Box::new(move |run| Ok(Box::new(swimmer_in(&scene, run.density)?))),
        water: Water::Scene,
    })
}

fn swimmer_in(scene: &str, density: f64) -> anyhow::Result<Swimmer> {
    let scene = with_attribute(scene, "hydro.wrench", "density", &density.to_string())?;
    Ok(Swimmer::new(Model::from_xml(&scene)?)?)
}
