//! A nominal model, and copies of it with changed parameters.
//!
//! The effects of a simulation act in the same stage of MuJoCo in which `hydro.wrench` applies
//! the attribute `effects`, through the same code, so that a fitted effect written to a file acts as it
//! did in the fit.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use parking_lot::Mutex;

use hydro_effects::{Entry, Id, Part, TargetKind, effect};
use hydro_gap::plant::{
    FreeBase, Plant, PlantDescription, PlantError, Simulation, backlash::armature,
};

use super::{
    backlash::Backlash,
    description,
    hidden_joints::{BacklashSimulation, Layout},
    model_spec,
    nuisances::{self, Nominal, Turn},
    passive_hook, sensors,
    simulation::{LoadSensor, MujocoSimulation},
};
use crate::{
    mujoco::{
        bodies::base_body,
        effects::{active_effects::ActiveEffects, bind, sizes, surroundings::Surroundings, walls},
        ffi::{
            ModelView,
            bindings::{mjOBJ_BODY, mjSTATE_FULLPHYSICS},
            scene_folder,
        },
        simulator::{Data, Integrator, Model, SimulatorError},
        wrench::instances,
    },
    plugin::{JointKind, bound::Acting},
};

/// A nominal model.
#[derive(Debug)]
pub struct MujocoPlant {
    model: Arc<Model>,
    description: PlantDescription,
    /// Number of the body, joint or actuator that each nuisance parameter is of.
    ids: Vec<usize>,
    /// The instances of `hydro.wrench` and their attributes.
    nominal: Vec<Nominal>,
    around: Surroundings,
    loads: Vec<LoadSensor>,
    /// The model's file, for models with backlash.
    path: PathBuf,
    /// Models with backlash in these joints.
    with_backlash: Mutex<Vec<WithBacklash>>,
    /// The latest copy with these nuisance parameters, gains and winds, for the many simulations that differ in effects
    /// alone.
    latest: Mutex<Option<(CopyKey, Copied)>>,
    /// Integrator in place of the MJCF's.
    integrator: Option<Integrator>,
    /// With Euler's integrator, where the model's is Runge-Kutta.
    cheaper: Option<Box<MujocoPlant>>,
}

/// A model with backlash in joints.
type WithBacklash = (Vec<Backlash>, Arc<MujocoPlant>);

/// Changes in a copy of the model: nuisance parameters, gains of actuators, the wind, and half the
/// backlash by joint [rad or m].
#[derive(Clone, Debug, Default, PartialEq)]
struct CopyKey {
    nuisances: Vec<f64>,
    gains: Vec<(usize, f64)>,
    wind: [f64; 3],
    backlashes: Vec<(usize, f64)>,
}

#[derive(Clone, Debug)]
struct Copied {
    model: Arc<Model>,
    moved_centres: Vec<(usize, [f64; 3], f64)>,
}

fn fault(error: impl std::fmt::Display) -> PlantError {
    PlantError(error.to_string())
}

impl MujocoPlant {
    /// Loads an MJCF; `hydro.wrench` and `hydro.load_cell` are known to it.
    ///
    /// # Errors
    /// A model that MuJoCo or a plugin refuses.
    pub fn load(path: &Path) -> Result<Self, PlantError> {
        let mut plant = Self::load_with(path, &[], None)?;
        if plant.model.view().runge_kutta() {
            let cheaper = Self::load_with(path, &[], Some(Integrator::Euler))?;
            plant.cheaper = Some(Box::new(cheaper));
        }
        Ok(plant)
    }

    /// `integrator`: in the place of the model's own.
    fn load_with(
        path: &Path,
        backlashes: &[Backlash],
        integrator: Option<Integrator>,
    ) -> Result<Self, PlantError> {
        let mut model = model_spec::load(path, backlashes).map_err(fault)?;
        if let Some(integrator) = integrator {
            model.set_integrator(integrator);
        }
        passive_hook::install(model.api());
        let view = model.view();
        let folder = scene_folder::folder(path);
        let nominal = instances::instances(view)
            .map(|id| {
                let settings =
                    scene_folder::known(folder.as_deref(), || instances::settings(view, id));
                let settings = settings.map_err(fault)?;
                let body = instances::carrying_body(view, id).unwrap_or(0);
                let around = instances::surroundings(view, &settings, body).map_err(fault)?;
                let effects = instances::entries(view, &settings, &around).map_err(fault)?;
                Ok(Nominal {
                    id,
                    settings,
                    around,
                    effects,
                })
            })
            .collect::<Result<Vec<_>, PlantError>>()?;
        let first = nominal.first().map(|of| of.around.clone());
        let around = Surroundings {
            is_hypothesis: true,
            ..first.unwrap_or_default()
        };
        let of_effect = |id: Id| -> Vec<String> {
            let all = nominal.iter().flat_map(|of| &of.effects);
            let found = all.filter(|entry| entry.effect == id);
            found.map(|entry| entry.target.clone()).collect()
        };
        let floating = of_effect(Id::Hydrostatics);
        let lifted = of_effect(Id::NetBuoyancy);
        let is_learned = nominal.iter().any(|of| of.settings.checkpoint.is_some());
        let has_buoyancy = |body: &str| {
            let mut all = floating.iter().chain(&lifted);
            is_learned || all.any(|of| of == body)
        };
        let (nuisances, ids) = nuisances::find(view, &nominal).into_iter().unzip();
        let loads = LoadSensor::all(view);
        let model = Arc::new(model);
        let mut data = Data::new(&model).map_err(fault)?;
        data.forward();
        let view = model.view();
        let density = sizes::density(view, around.density);
        let description = PlantDescription {
            timestep: model.timestep(),
            nq: model.nq(),
            nv: model.nv(),
            state_len: model.state_len(mjSTATE_FULLPHYSICS as i32),
            bodies: description::bodies(
                &data.view(),
                density,
                around.sea.waterline,
                &floating,
                has_buoyancy,
            ),
            base: free_base(view, &nominal, density),
            joints: description::joints(view),
            actuators: description::actuators(view),
            sensors: sensors::sensors(view),
            nuisances,
            wrench_bodies: instances::bodies(view),
            waterline: around.sea.waterline.unwrap_or(0.0),
            has_surface: around.sea.waterline.is_some(),
            walls: walls::standing(&data.view()),
            medium: description::medium(view, nominal.iter().any(Nominal::is_wet)),
            has_fluid: view.raw().opt.density > 0.0 || nominal.iter().any(Nominal::is_wet),
        };
        Ok(Self {
            model,
            description,
            ids,
            nominal,
            around,
            loads,
            path: path.to_owned(),
            with_backlash: Mutex::default(),
            latest: Mutex::default(),
            integrator,
            cheaper: None,
        })
    }

    /// The model with these changes; the nominal itself where there are none.
    fn copy(&self, key: &CopyKey) -> Result<Copied, SimulatorError> {
        let none = CopyKey {
            nuisances: vec![0.0; key.nuisances.len()],
            ..CopyKey::default()
        };
        if *key == none {
            return Ok(Copied {
                model: Arc::clone(&self.model),
                moved_centres: Vec::new(),
            });
        }
        {
            let latest = self.latest.lock();
            if let Some((known, copied)) = &*latest
                && known == key
            {
                return Ok(copied.clone());
            }
        }
        let mut model = self.model.try_clone()?;
        let turned = self.turned(&key.nuisances, true);
        let mut beside = nuisances::Beside::default();
        nuisances::turn(&mut model, &turned, &mut beside)?;
        for (actuator, factor) in &key.gains {
            nuisances::scale_gain(&mut model, *actuator, *factor);
        }
        model.add_wind(key.wind);
        model.set_ranges(&key.backlashes);
        let copied = Copied {
            model: Arc::new(model),
            moved_centres: beside.moved_centres,
        };
        let mut latest = self.latest.lock();
        *latest = Some((key.clone(), copied.clone()));
        Ok(copied)
    }

    /// The nuisance parameters that are not at zero, of the model or beside it.
    fn turned(&self, values: &[f64], of_model: bool) -> Vec<Turn> {
        let nuisances = self.description.nuisances.iter().zip(&self.ids);
        nuisances
            .zip(values)
            .map(|((nuisance, id), value)| Turn {
                quantity: nuisance.quantity,
                id: *id,
                value: *value,
            })
            .filter(|turn| turn.value != 0.0 && nuisances::is_of_model(turn.quantity) == of_model)
            .collect()
    }

    /// The joints with backlash among effects, and how much [rad or m].
    fn backlashes(&self, effects: &[Entry]) -> Vec<(Backlash, f64)> {
        let model = self.model.view();
        effects
            .iter()
            .filter_map(|entry| {
                let Part::Joint(part) = effect(entry.effect).part() else {
                    return None;
                };
                let amount = part.backlash(&entry.parameters)?;
                let joints = &self.description.joints;
                let joint = joints.iter().find(|joint| joint.name == entry.target)?;
                let (scale, step) = (&joint.scale, self.description.timestep);
                let rotor = model.dof_armature()[joint.dof];
                let backlash = Backlash {
                    joint: entry.target.clone(),
                    armature: armature(scale.inertia, rotor, scale.damping, step),
                    stop: 2.0 * step,
                };
                Some((backlash, amount))
            })
            .collect()
    }

    /// The model with backlash in these joints, compiled once.
    fn with_backlash(&self, backlashes: &[Backlash]) -> Result<Arc<Self>, PlantError> {
        let mut compiled = self.with_backlash.lock();
        if let Some((_, known)) = compiled.iter().find(|(known, _)| known == backlashes) {
            return Ok(Arc::clone(known));
        }
        let plant = Arc::new(Self::load_with(&self.path, backlashes, self.integrator)?);
        compiled.push((backlashes.to_vec(), Arc::clone(&plant)));
        Ok(plant)
    }

    fn simulate(
        &self,
        values: &[f64],
        effects: &[Entry],
        backlashes: Vec<(usize, f64)>,
    ) -> Result<MujocoSimulation, PlantError> {
        let known = &self.description.nuisances;
        if values.len() != known.len() {
            return Err(PlantError(format!(
                "{} values of nuisance parameters for a model with {}",
                values.len(),
                known.len()
            )));
        }
        if let Some((nuisance, value)) = known
            .iter()
            .zip(values)
            .find(|(_, value)| !value.is_finite())
        {
            return Err(PlantError(format!(
                "nuisance parameter `{}` is {value}",
                nuisance.name
            )));
        }
        let moving: Vec<Entry> = effects
            .iter()
            .filter(|entry| effect(entry.effect).card().target != TargetKind::Sensor)
            .cloned()
            .collect();
        let view = self.model.view();
        let mut bound = bind::bind(view, &moving, &self.around).map_err(fault)?;
        // Backlash is a joint of the model, not a force.
        bound
            .joints
            .retain(|joint| joint.acting.effect.card().id != Id::JointBacklash);
        let mut key = CopyKey {
            nuisances: values.to_vec(),
            backlashes,
            ..CopyKey::default()
        };
        // What MuJoCo has itself is changed there, as in a patched file.
        for changed in &mut bound.actuators {
            let factor = take(&mut changed.acting, Id::ActuatorGain)
                .into_iter()
                .filter_map(|acting| Some(acting.actuator()?.force_factor(&acting.parameters, 0.0)))
                .product::<f64>();
            if factor != 1.0 {
                key.gains.push((changed.actuator, factor));
            }
        }
        bound.actuators.retain(|changed| !changed.acting.is_empty());
        if view.has_fluid() {
            for acting in take(&mut bound.water, Id::Current) {
                if let Some(water) = acting.water() {
                    let more = water.velocity(&acting.parameters, [0.0; 3], 0.0);
                    for (sum, more) in key.wind.iter_mut().zip(more) {
                        *sum += more;
                    }
                }
            }
        }
        let beside = nuisances::turn_beside(&self.turned(values, false), &self.nominal);
        let copied = self.copy(&key).map_err(fault)?;
        let mut nominal = Vec::new();
        for (instance, entries) in beside.effects {
            let of = &self.nominal[instance];
            if let Some(turned) = instances::bound(view, &of.around, &entries).map_err(fault)? {
                nominal.push((of.id, turned));
            }
        }
        let active = ActiveEffects {
            memory: vec![0.0; bound.memory_len],
            bound,
            wrench_scale: beside.wrench_scale,
            command_lead: beside.command_lead,
            commands_before: 1.0 + beside.commands_before,
            reading_lead: beside.reading_lead,
            nominal,
            moved_centres: copied.moved_centres,
        };
        let data = Data::new(&copied.model).map_err(fault)?;
        let base = self.description.base.as_ref();
        let base = base.map(|base| (base.qpos, base.dof));
        Ok(MujocoSimulation::new(data, active, &self.loads, base))
    }
}

/// The first body with a free joint. What a plugin that is put on it would know of the water is what the
/// instance that it carries knows, else what the first one does, else MuJoCo's own fluid.
fn free_base(model: ModelView<'_>, nominal: &[Nominal], density: f64) -> Option<FreeBase> {
    let joints = base_body::joints(model);
    let (id, joint) = joints
        .iter()
        .enumerate()
        .find(|(_, joint)| joint.kind == JointKind::Free)?;
    let body = model.jnt_bodyid()[id] as usize;
    let own = nominal
        .iter()
        .find(|of| model.body_plugin()[body] == of.id as i32);
    let known = own.or(nominal.first()).map(|of| &of.settings);
    let wind = if model.has_fluid() {
        model.raw().opt.wind
    } else {
        [0.0; 3]
    };
    Some(FreeBase {
        body: model.name(mjOBJ_BODY as i32, body),
        qpos: joint.qpos,
        dof: joint.dof,
        joints: joints
            .iter()
            .filter(|joint| matches!(joint.kind, JointKind::Hinge | JointKind::Slide))
            .map(|joint| joint.name.clone())
            .filter(|name| !name.is_empty())
            .collect(),
        density: own.map_or(density, |of| of.settings.density),
        water: known.map_or(wind, |settings| settings.current),
        water_moves: nominal.iter().any(Nominal::moves_water),
        learned: own.is_some_and(|of| of.settings.checkpoint.is_some()),
    })
}

/// Takes the effects of a name out of a list.
fn take(list: &mut Vec<Acting>, id: Id) -> Vec<Acting> {
    let (taken, left) = std::mem::take(list)
        .into_iter()
        .partition(|acting| acting.effect.card().id == id);
    *list = left;
    taken
}

impl Plant for MujocoPlant {
    fn description(&self) -> &PlantDescription {
        &self.description
    }

    fn cheaper(&self) -> Option<&dyn Plant> {
        self.cheaper.as_deref().map(|plant| plant as &dyn Plant)
    }

    fn simulation(
        &self,
        nuisances: &[f64],
        effects: &[Entry],
    ) -> Result<Box<dyn Simulation>, PlantError> {
        let (backlashes, amounts): (Vec<Backlash>, Vec<f64>) =
            self.backlashes(effects).into_iter().unzip();
        if backlashes.is_empty() {
            return Ok(Box::new(self.simulate(nuisances, effects, Vec::new())?));
        }
        let plant = self.with_backlash(&backlashes)?;
        let (layout, joints) = Layout::new(self.model.view(), plant.model.view(), &backlashes);
        let halves = amounts.iter().map(|amount| 0.5 * amount);
        let ranges = joints.into_iter().zip(halves).collect();
        let inner = plant.simulate(nuisances, effects, ranges)?;
        Ok(Box::new(BacklashSimulation::new(inner, layout)))
    }
}
