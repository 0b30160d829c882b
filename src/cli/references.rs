//! Reference methods of the closed loop: the baselines (fitted drag laws, MuJoCo's box fluid) and the true wrench.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use hydro_frames::Wrench;
use hydro_model::water::water_in_words;
use hydro_plugin::mujoco::simulator::{Model, SimulatorError, Swimmer};
use hydro_training::{
    comparison::{Method, ORACLE, ORACLE_OF_ALL, ORACLE_OF_THE_BASE, Water, WrenchAtState},
    dataset::Dataset,
    drag::{Drag, fit_drag},
    rollouts::{Rollout, Rollouts},
    simulator::Simulator,
};

use super::files::sha256;

/// Baselines, which the learned wrench must beat.
pub(super) const BASELINES: [&str; 3] = ["fitted drag, coupled", "fitted drag, by axis", BOX_FLUID];
/// MuJoCo's own fluid by inertia boxes, with exact buoyancy.
pub(super) const BOX_FLUID: &str = "box fluid";

/// Scenes of the reference methods.
pub(super) struct Scenes {
    pub(super) box_fluid: PathBuf,
    bare: PathBuf,
    truth: Truth,
}

/// What tells the true wrench.
enum Truth {
    /// MuJoCo's own fluid in this scene, at any state.
    Scene(PathBuf),
    /// The recorded force of every physics step alone.
    Recorded,
}

impl Scenes {
    /// Scenes in `folder`; the true one is that in which `rollouts` were recorded.
    ///
    /// # Errors
    /// A true scene that is missing, cannot be built, or has changed since.
    pub(super) fn find(folder: &Path, rollouts: &Rollouts) -> anyhow::Result<Self> {
        let index = &rollouts.index;
        let name = Path::new(&index.model)
            .file_name()
            .with_context(|| format!("the rollouts' model `{}`: no file", index.model))?;
        let truth = folder.join(name);
        let bytes = hydro_files::read(&truth, hydro_files::TEXT)
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
        let truth = match &index.water {
            None => Truth::Scene(truth),
            Some(water) if rollouts.runs.iter().any(|run| run.step_force.is_none()) => bail!(
                "the rollouts are of the water {}, which MuJoCo does not have, and hold no `step_force`: record them again",
                water_in_words(Some(water))
            ),
            Some(_) => Truth::Recorded,
        };
        Ok(Self {
            box_fluid: folder.join("b1_box_fluid.xml"),
            bare: folder.join("b1.xml"),
            truth,
        })
    }
}

/// Drag laws fitted on the training split, by the names of [`BASELINES`].
pub(super) fn fitted_drags(data: &Dataset) -> anyhow::Result<Vec<(&'static str, Drag)>> {
    let folder = data.folder().display();
    let fit = fit_drag(&data.manifest().features, &data.split("train", None)?)
        .with_context(|| format!("{folder}: its features hold no base twist to fit a drag on"))?;
    let coupled = fit
        .solve()
        .with_context(|| format!("{folder}: fitting the drag baseline"))?;
    Ok(vec![
        (BASELINES[0], coupled),
        (BASELINES[1], fit.solve_diagonal()),
    ])
}

/// The baselines, and the true wrench: at the simulator's own state and as recorded, or the recorded force of every step.
/// Laws of drag stand in a model without added mass: none where the truth has it.
pub(super) fn reference_methods<'a>(
    scenes: &'a Scenes,
    drags: &'a [(&'static str, Drag)],
) -> Vec<Method<'a, anyhow::Error>> {
    let drags = match scenes.truth {
        Truth::Scene(_) => drags,
        Truth::Recorded => &[],
    };
    let mut all: Vec<_> = drags
        .iter()
        .map(|(name, drag)| Method {
            name: (*name).to_owned(),
            simulator: Box::new(|run| buoyant(&scenes.box_fluid, run.density, false)),
            water: Water::Law(Box::new(|twist, density| drag.wrench(twist, density))),
        })
        .collect();
    all.push(Method {
        name: BOX_FLUID.to_owned(),
        simulator: Box::new(|run| buoyant(&scenes.box_fluid, run.density, true)),
        water: Water::Scene,
    });
    let bare = || {
        Box::new(|_: &Rollout| {
            Ok(Box::new(Swimmer::new(Model::load(&scenes.bare)?)?) as Box<dyn Simulator>)
        })
    };
    let oracle = |name: &str, water| Method {
        name: name.to_owned(),
        simulator: bare(),
        water,
    };
    all.extend(match &scenes.truth {
        Truth::Scene(truth) => [
            oracle(
                ORACLE,
                Water::Truth(Box::new(|run| true_wrench(truth, run.density))),
            ),
            oracle("oracle, replayed", Water::Replayed),
        ],
        Truth::Recorded => [
            oracle(ORACLE_OF_THE_BASE, Water::Steps { joints: false }),
            oracle(ORACLE_OF_ALL, Water::Steps { joints: true }),
        ],
    });
    all
}

/// A scene with exact buoyancy at a density, with or without MuJoCo's own fluid.
fn buoyant(scene: &Path, density: f64, fluid: bool) -> anyhow::Result<Box<dyn Simulator>> {
    Ok(Box::new(Swimmer::new(buoyant_model(
        scene, density, fluid,
    )?)?))
}

/// The true base wrench at any state; zero if the scene can no longer be built.
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

/// The model of [`buoyant`].
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
