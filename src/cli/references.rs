//! Whom a learned wrench is measured by in closed loop: fitted drag laws, MuJoCo's box fluid, and the true wrench itself.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use hydro_frames::Wrench;
use hydro_plugin::mujoco::simulator::{Model, SimulatorError, Swimmer};
use hydro_training::{
    comparison::{Contender, ORACLE, Water, closed_loop::WrenchAtState, open_loop::fit_drag},
    dataset::Dataset,
    drag::Drag,
    rollouts::{Rollout, Rollouts},
    simulator::Simulator,
};

use super::sha256;

/// Whom the learned wrench must beat.
pub(super) const RIVALS: [&str; 3] = ["fitted drag, coupled", "fitted drag, by axis", BOX_FLUID];
/// MuJoCo's own fluid by inertia boxes, with exact buoyancy.
pub(super) const BOX_FLUID: &str = "box fluid";

/// Scenes of the references.
pub(super) struct Scenes {
    pub(super) box_fluid: PathBuf,
    bare: PathBuf,
    truth: PathBuf,
}

impl Scenes {
    /// Those in `folder`; the truth is the one that `rollouts` were recorded in.
    ///
    /// # Errors
    /// A truth that is not there, cannot be built, or is not the file that it was.
    pub(super) fn of(folder: &Path, rollouts: &Rollouts) -> anyhow::Result<Self> {
        let index = &rollouts.index;
        let name = Path::new(&index.model)
            .file_name()
            .with_context(|| format!("the rollouts' model `{}`: no file", index.model))?;
        let truth = folder.join(name);
        let bytes = std::fs::read(&truth)
            .with_context(|| format!("the rollouts' model {}", truth.display()))?;
        let found = sha256(&bytes);
        if found != index.model_sha256 {
            bail!(
                "{}: sha256 {found}, but the rollouts were recorded in a file of that name with {}: record them again",
                truth.display(),
                index.model_sha256
            );
        }
        // Loaded once here, so that a fault in the scene is an error and not a panic in the loop.
        buoyant_model(&truth, 1000.0, true)?;
        Ok(Self {
            box_fluid: folder.join("b1_box_fluid.xml"),
            bare: folder.join("b1.xml"),
            truth,
        })
    }
}

/// Drag laws fitted on the training split, by the names of [`RIVALS`].
pub(super) fn drags(data: &Dataset) -> anyhow::Result<Vec<(&'static str, Drag)>> {
    let folder = data.folder().display();
    let fit = fit_drag(&data.manifest().features, &data.split("train", None)?)
        .with_context(|| format!("{folder}: its features hold no base twist to fit a drag on"))?;
    let coupled = fit
        .solve()
        .with_context(|| format!("{folder}: fitting the drag rival"))?;
    Ok(vec![
        (RIVALS[0], coupled),
        (RIVALS[1], fit.solve_diagonal()),
    ])
}

/// The rivals, and the true wrench at the contender's own state and as it was recorded.
pub(super) fn references<'a>(
    scenes: &'a Scenes,
    drags: &'a [(&'static str, Drag)],
) -> Vec<Contender<'a, anyhow::Error>> {
    let mut all: Vec<_> = drags
        .iter()
        .map(|(name, drag)| Contender {
            name: (*name).to_owned(),
            simulator: Box::new(|run| buoyant(&scenes.box_fluid, run.density, false)),
            water: Water::Law(Box::new(|twist, density| drag.wrench(twist, density))),
        })
        .collect();
    all.push(Contender {
        name: BOX_FLUID.to_owned(),
        simulator: Box::new(|run| buoyant(&scenes.box_fluid, run.density, true)),
        water: Water::OfTheScene,
    });
    let bare = || {
        Box::new(|_: &Rollout| {
            Ok(Box::new(Swimmer::new(Model::load(&scenes.bare)?)?) as Box<dyn Simulator>)
        })
    };
    all.push(Contender {
        name: ORACLE.to_owned(),
        simulator: bare(),
        water: Water::Truth(Box::new(|run| true_wrench(&scenes.truth, run.density))),
    });
    all.push(Contender {
        name: "oracle, replayed".to_owned(),
        simulator: bare(),
        water: Water::Replayed,
    });
    all
}

/// A scene with exact buoyancy at a density, with or without MuJoCo's own fluid.
fn buoyant(scene: &Path, density: f64, fluid: bool) -> anyhow::Result<Box<dyn Simulator>> {
    Ok(Box::new(Swimmer::new(buoyant_model(
        scene, density, fluid,
    )?)?))
}

/// The truth's base wrench at any state; a scene that cannot be built any more gives none.
fn true_wrench(scene: &Path, density: f64) -> Box<WrenchAtState> {
    let mut truth = buoyant_model(scene, density, true)
        .and_then(Swimmer::new)
        .ok();
    Box::new(move |qpos, qvel| {
        truth.as_mut().map_or(Wrench::default(), |truth| {
            truth.passive_wrench_at(qpos, qvel)
        })
    })
}

/// The model behind it.
pub(super) fn buoyant_model(
    scene: &Path,
    density: f64,
    fluid: bool,
) -> Result<Model, SimulatorError> {
    let mut model = Model::load(scene)?;
    model.set_density(density)?;
    if !fluid {
        model.set_fluid(0.0, 0.0);
    }
    Ok(model)
}
