//! Ties named effects to a model: names become numbers, and what does not fit is refused.

use std::sync::Arc;

use hydro_effects::{
    Entry, Id, Motion, Part, Target, TargetKind, Targets, card::ActuatorScale, effect, is_matrix,
    listed_id, potential_flow::PotentialFlow,
};
use serde_json::Value;

use super::{
    sizes::{self, Found},
    surroundings::Surroundings,
    walls,
    wet_bodies::{check_hull, displacing, in_waves, notes, panels, wet_body},
};
use crate::{
    mujoco::{
        bodies::joint_space::last_dof,
        ffi::{
            ModelView,
            bindings::{
                mjBIAS_AFFINE, mjBIAS_NONE, mjGAIN_AFFINE, mjGAIN_FIXED, mjOBJ_ACTUATOR,
                mjOBJ_BODY, mjOBJ_JOINT,
            },
        },
    },
    plugin::{
        Bound,
        bound::{Acting, ChangedActuator, MovedJoint, Radiating, WetBody},
    },
};

/// Why an effect on a sensor is refused.
const NO_MOTION: &str =
    "it changes a reading and no motion; it belongs into `sensors` of a verdict's patch";

/// Why backlash is refused where a simulation has it as an effect.
const NO_FORCE: &str = "it is no force but a second joint: put one of the same type and axis behind the first in its <body>, with \
                        `range` of half the play to either side";

/// Numbers of memory of all effects of an instance, at most: 128 MiB.
const MOST_MEMORY: usize = 1 << 24;

/// Ties effects to a model.
pub(crate) fn bind(
    model: ModelView<'_>,
    entries: &[Entry],
    around: &Surroundings,
) -> Result<Bound, String> {
    let mut bound = Bound {
        walls: walls::find(model),
        density: sizes::density(model, around.density),
        sea: around.sea.clone(),
        current: around.current,
        ..Bound::default()
    };
    for entry in entries {
        add(model, entry, around, &mut bound)
            .map_err(|reason| format!("effect `{}`: {reason}", entry.effect))?;
    }
    if let Some(flow) = &around.potential_flow {
        add_potential_flow(model, flow, around, &mut bound)
            .map_err(|reason| format!("attribute `potential_flow`: {reason}"))?;
    }
    if !bound.water.is_empty() {
        bound.displacing = displacing(model, bound.density);
    }
    for wet in &mut bound.bodies {
        wet.in_waves = around.moves_in_waves() && wet.floats() && !wet.is_excited();
        wet.panels = panels(around, wet);
    }
    bound.in_waves = in_waves(model, around, &bound);
    bound.notes = notes(model, around, &bound);
    bound.memory_len += bound.sea.memory_len();
    Ok(bound)
}

fn add(
    model: ModelView<'_>,
    entry: &Entry,
    around: &Surroundings,
    bound: &mut Bound,
) -> Result<(), String> {
    if entry.effect == Id::JointBacklash && !around.is_hypothesis {
        return Err(NO_FORCE.to_owned());
    }
    let effect = effect(entry.effect);
    let kind = effect.card().target;
    let found = target(model, kind, &entry.target)?;
    let known = effect.parameters(&found.sizes(model, bound.density, around.hull.as_deref()));
    let whole = effect.matrix_part().is_some() && is_matrix(&entry.parameters);
    if !whole && known.len() != entry.parameters.len() {
        let names: Vec<String> = known
            .iter()
            .map(|parameter| format!("{} [{}]", parameter.name, parameter.unit))
            .collect();
        return Err(format!(
            "{} values for `{}`; expected {}: {}",
            entry.parameters.len(),
            entry.target,
            known.len(),
            names.join(", ")
        ));
    }
    if whole && let Some(value) = entry.parameters.iter().find(|value| !value.is_finite()) {
        return Err(format!("the matrix has {value}; expected finite numbers"));
    }
    if let Some((parameter, value)) = known
        .iter()
        .zip(&entry.parameters)
        .find(|(_, value)| !value.is_finite())
    {
        return Err(format!(
            "`{}` is {value}; expected a number in {}",
            parameter.name, parameter.unit
        ));
    }
    let step = model.raw().opt.timestep;
    let memory_len = entry_memory_len(entry, step);
    if bound.memory_len.saturating_add(memory_len) > MOST_MEMORY {
        return Err(format!(
            "its memory takes {memory_len} numbers at a timestep of {} s, and {} are taken; expected at most {MOST_MEMORY} in \
             all: a longer timestep or a shorter delay",
            hydro_files::number(step),
            bound.memory_len
        ));
    }
    let acting = Acting {
        effect,
        parameters: entry.parameters.clone(),
        memory: bound.memory_len..bound.memory_len + memory_len,
        commands: controls(model, effect.commands())?,
    };
    match (effect.part(), found) {
        (Part::Sensor(_), _) => {
            return Err(NO_MOTION.to_owned());
        }
        (Part::Water(_), _) => bound.water.push(acting),
        (Part::Body(_), Found::Body(body)) => add_to_body(model, body, acting, around, bound)?,
        (Part::Joint(_), Found::Joint(joint)) => bound.joints.push(MovedJoint {
            qpos: model.jnt_qposadr()[joint] as usize,
            dof: model.jnt_dofadr()[joint] as usize,
            acting,
        }),
        (Part::Actuator(_), Found::Actuator(actuator)) => {
            add_to_actuator(model, actuator, acting, around, bound)?;
        }
        _ => return Err("its card names another kind of target than its part".to_owned()),
    }
    bound.memory_len += memory_len;
    Ok(())
}

/// Indices in `ctrl` of the commands of actuators.
fn controls(model: ModelView<'_>, actuators: &[String]) -> Result<Vec<usize>, String> {
    let control = |name: &String| match target(model, TargetKind::Actuator, name)? {
        Found::Actuator(id) => sizes::address(model, id)
            .map(|address| address.control)
            .ok_or_else(|| format!("actuator `{name}` has several controls; expected one")),
        Found::Body(_) | Found::Joint(_) => Err(format!("`{name}` is no actuator")),
    };
    actuators.iter().map(control).collect()
}

/// The elements that effects of a kind can act on, and the word for them; `None` for sensors, which
/// move nothing.
fn usable(model: ModelView<'_>, kind: TargetKind) -> Option<(&'static str, Vec<(i32, usize)>)> {
    let (code, word, ids): (_, _, Vec<usize>) = match kind {
        TargetKind::Body => (
            mjOBJ_BODY,
            "body",
            (1..model.bodies())
                .filter(|id| last_dof(model, *id) >= 0)
                .collect(),
        ),
        TargetKind::Joint => (
            mjOBJ_JOINT,
            "joint",
            (0..model.jnt_type().len())
                .filter(|id| sizes::is_scalar(model, *id))
                .collect(),
        ),
        TargetKind::Actuator => (
            mjOBJ_ACTUATOR,
            "actuator",
            (0..model.actuator_trntype().len()).collect(),
        ),
        TargetKind::Sensor => return None,
    };
    Some((word, ids.into_iter().map(|id| (code as i32, id)).collect()))
}

/// The element of that name and kind.
pub(crate) fn target(model: ModelView<'_>, kind: TargetKind, name: &str) -> Result<Found, String> {
    let (word, ids) = usable(model, kind).ok_or(NO_MOTION)?;
    let label = |(code, id): &(i32, usize)| model.label(*code, word, *id);
    match ids.iter().find(|of| label(of) == name) {
        Some((_, id)) => Ok(match kind {
            TargetKind::Body => Found::Body(*id),
            TargetKind::Joint => Found::Joint(*id),
            _ => Found::Actuator(*id),
        }),
        None => {
            let exists: Vec<String> = ids.iter().map(label).collect();
            let wanted = match kind {
                TargetKind::Body => "a body that moves",
                TargetKind::Joint => "a hinge or slide",
                _ => "an actuator",
            };
            let exists = if exists.is_empty() {
                "none".to_owned()
            } else {
                exists.join(", ")
            };
            Err(format!(
                "target `{name}`; expected {wanted}, of which the model has: {exists}"
            ))
        }
    }
}

/// A model's elements, as a file of effects names them.
#[derive(Debug)]
pub(crate) struct ModelTargets<'a> {
    pub(crate) model: ModelView<'a>,
    /// The water around them.
    pub(crate) around: &'a Surroundings,
}

impl Targets for ModelTargets<'_> {
    fn find(&self, kind: TargetKind, name: &str) -> Option<Target> {
        let found = target(self.model, kind, name).ok()?;
        let density = sizes::density(self.model, self.around.density);
        let mut sizes = found.sizes(self.model, density, self.around.hull.as_deref());
        if let (Target::Body(scale), Found::Body(body)) = (&mut sizes, found)
            && let Some(given) = self.around.given_volume(body)
        {
            scale.hull_volume = given;
        }
        Some(sizes)
    }

    fn names(&self, kind: TargetKind) -> Vec<String> {
        let Some((word, ids)) = usable(self.model, kind) else {
            return Vec::new();
        };
        ids.into_iter()
            .map(|(code, id)| self.model.label(code, word, id))
            .collect()
    }
}

/// Numbers of memory that a text of effects needs, in a model of this step [s]; `None` where it is at fault. MuJoCo asks
/// while it still compiles the model, so targets are not looked at; what is wrong with the text shows later.
pub(crate) fn memory_len(text: &str, step: f64) -> Option<usize> {
    let document: Value = serde_json::from_str(text).ok()?;
    let mut sum = 0usize;
    for item in document.get("effects")?.as_array()? {
        let id = listed_id(item)?;
        let values = item.get("parameters")?;
        // The names of an actuator's parameters do not depend on its sizes, and other memories not on parameters.
        let sizes = Target::Actuator(ActuatorScale {
            command: 1.0,
            inflow: 0.0,
            step,
            thrusts: true,
        });
        let parameters = effect(id)
            .parameters(&sizes)
            .iter()
            .map(|parameter| match values.get(&parameter.name) {
                Some(value) => value.as_f64(),
                None => Some(parameter.left_out.unwrap_or(parameter.null)),
            })
            .collect::<Option<Vec<f64>>>()?;
        let entry = Entry {
            effect: id,
            target: String::new(),
            parameters,
        };
        sum = sum.saturating_add(entry_memory_len(&entry, step));
    }
    (sum <= MOST_MEMORY).then_some(sum)
}

fn entry_memory_len(entry: &Entry, step: f64) -> usize {
    match effect(entry.effect).part() {
        Part::Body(part) => part.memory_len(),
        Part::Joint(part) => part.memory_len(),
        Part::Actuator(part) => part.memory_len(&entry.parameters, step),
        Part::Water(_) | Part::Sensor(_) => 0,
    }
}

fn add_to_body(
    model: ModelView<'_>,
    body: usize,
    acting: Acting,
    around: &Surroundings,
    bound: &mut Bound,
) -> Result<(), String> {
    if acting.effect.card().id == Id::Hydrostatics {
        check_hull(model, body, around)?;
    }
    let wet = known_wet_body(model, body, around, bound);
    if !wet.full_rows && has_inertia(&acting) {
        return Err(no_room(model, body));
    }
    wet.acting.push(acting);
    Ok(())
}

/// A body among those that effects act on, where it is put if it is not there.
fn known_wet_body<'a>(
    model: ModelView<'_>,
    body: usize,
    around: &Surroundings,
    bound: &'a mut Bound,
) -> &'a mut WetBody {
    let known = bound.bodies.iter().position(|wet| wet.body == body);
    let at = known.unwrap_or_else(|| {
        bound
            .bodies
            .push(wet_body(model, body, around, bound.density));
        bound.bodies.len() - 1
    });
    &mut bound.bodies[at]
}

/// Refusal of inertia on a body whose inertia has no room for it.
fn no_room(model: ModelView<'_>, body: usize) -> String {
    let name = model.label(mjOBJ_BODY as i32, "body", body);
    format!(
        "it adds inertia to body `{name}`, whose inertia MuJoCo keeps as a diagonal without room for \
         that; put an empty child into the body, <body name=\"{name}_water\"/>, and it keeps all of it"
    )
}

fn add_potential_flow(
    model: ModelView<'_>,
    flow: &Arc<PotentialFlow>,
    around: &Surroundings,
    bound: &mut Bound,
) -> Result<(), String> {
    let Some(carrier) = around.carrier.map(|carrier| carrier.body) else {
        return Ok(());
    };
    let memory = bound.memory_len..bound.memory_len + flow.state_len();
    let end = memory.end;
    let wet = known_wet_body(model, carrier, around, bound);
    if !wet.full_rows {
        return Err(no_room(model, carrier));
    }
    let twice = [Id::AddedMass, Id::WakeMemory].into_iter();
    if let Some(id) = twice.into_iter().find(|id| wet.has(*id)) {
        return Err(format!(
            "body `{}` has the effect `{id}` too, which the flow has already; take the effect away",
            model.label(mjOBJ_BODY as i32, "body", carrier)
        ));
    }
    wet.potential_flow = Some(Radiating {
        flow: Arc::clone(flow),
        stepping: flow.stepping(model.raw().opt.timestep),
        memory,
    });
    bound.memory_len = end;
    Ok(())
}

/// True where an effect adds inertia, asked of it in some motion.
fn has_inertia(acting: &Acting) -> bool {
    let motion = Motion {
        time: 0.0,
        position: [0.0; 3],
        world_from_base: nalgebra::UnitQuaternion::identity(),
        linear: [0.1; 3],
        angular: [0.1; 3],
        water_velocity: [0.0; 3],
        water_acceleration: [0.0; 3],
        gravity: [0.0, 0.0, -9.81],
        density: 1000.0,
        centre: [0.0; 3],
        middle: [0.0; 3],
        extent: [1.0; 3],
        volume: 1.0,
        upthrust: [0.0; 6],
        depth: Some(1.0),
        wall: Some((1.0, [0.0, 0.0, 1.0])),
        commands: Vec::new(),
    };
    acting
        .body()
        .is_some_and(|part| part.inertia(&acting.parameters, &motion).is_some())
}

fn add_to_actuator(
    model: ModelView<'_>,
    actuator: usize,
    acting: Acting,
    around: &Surroundings,
    bound: &mut Bound,
) -> Result<(), String> {
    let name = model.label(mjOBJ_ACTUATOR as i32, "actuator", actuator);
    let address = sizes::address(model, actuator).ok_or_else(|| {
        format!("actuator `{name}` has several controls or outputs; expected one of each")
    })?;
    let (gain, bias) = (
        model.actuator_gaintype()[actuator] as u32,
        model.actuator_biastype()[actuator] as u32,
    );
    let plain = (gain == mjGAIN_FIXED || gain == mjGAIN_AFFINE)
        && (bias == mjBIAS_NONE || bias == mjBIAS_AFFINE)
        && model.actuator_plugin()[actuator] < 0;
    let stateless = model.actuator_actadr()[actuator] < 0;
    let changes_command = !matches!(
        acting.effect.card().id,
        Id::ActuatorGain | Id::InflowThrustLoss | Id::ThrustCurve
    );
    // A command that is changed before the step needs no force to be known.
    let needs_force = !(changes_command && around.is_hypothesis);
    if needs_force && !plain {
        return Err(format!(
            "actuator `{name}` is of a type whose force is not known beforehand; expected a gain that is \
             fixed or affine and a bias that is none or affine"
        ));
    }
    if changes_command && !stateless && !around.is_hypothesis {
        return Err(format!(
            "actuator `{name}` has an activation between command and force; expected one without"
        ));
    }
    let known = bound
        .actuators
        .iter()
        .position(|changed| changed.actuator == actuator);
    let at = known.unwrap_or_else(|| {
        bound.actuators.push(ChangedActuator {
            actuator,
            control: address.control,
            output: address.output,
            thrust: sizes::thrust(model, actuator),
            acting: Vec::new(),
        });
        bound.actuators.len() - 1
    });
    bound.actuators[at].acting.push(acting);
    Ok(())
}
