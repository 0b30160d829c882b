//! Effects in a simulation: the one place where they act, for the plugin and for `hydro gap` alike.
//!
//! A body's effects are a wrench w(V) and an inertia A, both in the body's frame about its origin, V its
//! velocity relative to the water there. With J v the velocity of the origin and the angular velocity in
//! that frame's directions, J v' + b their accelerations as the world sees them, and D = -dw/dV, a step of
//! length h from v solves
//!
//! ```text
//! (M + J^T (A + h D) J) v' = forces + J^T (w - A b)            h D not under Runge-Kutta
//! ```
//!
//! A thus acts as effective mass, exactly, whatever it is beside the body's own, and so does the rotor
//! inertia of a joint; the drag is linearly implicit, so that none is too stiff for a light body. The sum
//! goes into MuJoCo's inertia matrix in the passive stage, made anew each time, so that constraints, integrators and accelerometers know it.
//! Inverse dynamics, which MuJoCo does without that matrix, does not.

use hydro_effects::{Id, JointMotion};
use nalgebra::{Vector3, Vector6};

use super::{
    active_effects, actuation,
    body_load::{BodyLoad, body_load, commands, motion},
    frame::Frame,
    potential_flow,
    source::{Source, sea_memory_start},
    submersion::wet_part,
    water::Water,
};
use crate::{
    mujoco::{
        bodies::{
            fluid_loads,
            joint_space::{last_dof, rotation, vector},
        },
        ffi::{DataView, bindings::mjDSBL_GRAVITY},
    },
    plugin::bound::{Acting, Displacing, MovedJoint},
};

/// Forces and inertias to add to MuJoCo's, collected while the data is read.
#[derive(Default)]
pub(crate) struct Additions {
    forces: Vec<(usize, f64)>,
    /// Row of a degree of freedom, column by its place in that row, value.
    inertias: Vec<(usize, Place, f64)>,
    touches_inertia: bool,
    /// The first effect whose force is no number: it counts as none.
    pub(crate) fault: Option<Id>,
}

#[derive(Clone, Copy)]
enum Place {
    /// Number of entries before it in the row.
    Column(usize),
    Diagonal,
}

impl Additions {
    /// Makes the accelerations no numbers, so that the simulation counts as one that blew up.
    pub(crate) fn spoil(&mut self) {
        self.forces.push((0, f64::NAN));
    }

    /// Room for what bodies and joints add, taken once.
    fn with_room(sources: &[Source<'_>]) -> Self {
        let (mut forces, mut inertias) = (0, 0);
        for source in sources {
            for wet in &source.bound.bodies {
                let dofs = wet.dofs.len();
                forces += dofs;
                inertias += if wet.full_rows {
                    dofs * (dofs + 1) / 2
                } else {
                    dofs
                };
            }
            forces += source.bound.joints.len();
            inertias += source.bound.joints.len();
        }
        Self {
            forces: Vec::with_capacity(forces),
            inertias: Vec::with_capacity(inertias),
            ..Self::default()
        }
    }

    /// The effects of all sources, in their order.
    pub(crate) fn collect(data: &DataView<'_>, sources: &[Source<'_>]) -> Self {
        let mut sum = Self::with_room(sources);
        let model = data.model();
        let water = Water::new(data, sources);
        let step = model.raw().opt.timestep;
        for source in sources {
            for wet in &source.bound.bodies {
                let load = body_load(data, source, &water, wet);
                sum.fault = sum.fault.or(load.fault);
                sum.add_body(&load);
            }
            for joint in &source.bound.joints {
                let Some(part) = joint.acting.joint() else {
                    continue;
                };
                let motion = joint_motion(data, joint);
                let parameters = &joint.acting.parameters;
                let memory = &source.memory[joint.acting.memory.clone()];
                let force = part.force(parameters, &motion, memory);
                if !force.is_finite() {
                    sum.fault = sum.fault.or(Some(joint.acting.effect.card().id));
                    continue;
                }
                sum.forces.push((joint.dof, force));
                sum.touches_inertia = true;
                let mut implicit = part.inertia(parameters);
                if !model.runge_kutta() {
                    implicit += step * part.damping(parameters, &motion, memory).max(0.0);
                }
                sum.inertias.push((joint.dof, Place::Diagonal, implicit));
            }
            for changed in &source.bound.actuators {
                let more =
                    actuation::correction(data, source, changed, |at| water.velocity(source, at));
                actuation::in_joint_space(data, changed.output, more, &mut sum.forces);
            }
        }
        if let Some(active) = active_effects::current() {
            sum.add_buoyancy_torques(data, &active.moved_centres);
        }
        if water.moves() {
            moving_water(data, &water, |body, at, force, torque| {
                for_each_dof(data, body, |dof| {
                    let power = generalised_force(data, body, dof, at, force, torque);
                    sum.forces.push((dof, power));
                });
            });
        }
        sum
    }

    fn add_body(&mut self, load: &BodyLoad<'_>) {
        let columns = &load.frame.columns;
        for (dof, column) in load.wet.dofs.iter().zip(columns) {
            self.forces.push((*dof, column.dot(&load.wrench)));
        }
        self.touches_inertia = true;
        let Some(implicit) = &load.implicit else {
            return;
        };
        for (row, (dof, column)) in load.wet.dofs.iter().zip(columns).enumerate() {
            let moved = implicit * column;
            if load.wet.full_rows {
                for (place, other) in columns[..=row].iter().enumerate() {
                    self.inertias
                        .push((*dof, Place::Column(place), other.dot(&moved)));
                }
            } else {
                // No room for products: the sum of the row bounds them, so the step stays stable.
                let lumped = columns.iter().map(|other| other.dot(&moved).abs()).sum();
                self.inertias.push((*dof, Place::Diagonal, lumped));
            }
        }
    }

    /// Buoyancy of a body stays where it is when its centre of mass, which MuJoCo's gravity
    /// compensation acts at, is moved.
    fn add_buoyancy_torques(&mut self, data: &DataView<'_>, moved: &[(usize, [f64; 3], f64)]) {
        let option = &data.model().raw().opt;
        if option.disableflags & mjDSBL_GRAVITY as i32 != 0 {
            return;
        }
        for (body, way, buoyancy) in moved {
            let force = -*buoyancy * Vector3::from(option.gravity);
            let way = rotation(data.xmat(), *body) * Vector3::from(*way);
            let torque = (-way).cross(&force);
            let at = vector(data.xipos(), *body);
            for_each_dof(data, *body, |dof| {
                let power = generalised_force(data, *body, dof, at, Vector3::zeros(), torque);
                self.forces.push((dof, power));
            });
        }
    }

    /// Adds it all.
    pub(crate) fn apply(self, data: &mut DataView<'_>) {
        let passive = data.qfrc_passive_mut();
        for (dof, force) in self.forces {
            passive[dof] += force;
        }
        if !self.touches_inertia {
            return;
        }
        data.make_inertia();
        let model = data.model();
        let matrix = data.M_mut();
        for (dof, place, value) in self.inertias {
            let start = model.M_rowadr()[dof] as usize;
            let at = match place {
                Place::Column(column) => column,
                Place::Diagonal => model.M_rownnz()[dof] as usize - 1,
            };
            matrix[start + at] += value;
        }
        data.factor_inertia();
    }
}

/// Motion of a joint.
fn joint_motion(data: &DataView<'_>, joint: &MovedJoint) -> JointMotion {
    JointMotion {
        position: data.qpos()[joint.qpos],
        velocity: data.qvel()[joint.dof],
        time: data.time(),
        velocity_per_force: data.model().raw().opt.timestep
            * data.model().dof_invweight0()[joint.dof],
        commands: commands(data, &joint.acting),
    }
}

/// Calls with every degree of freedom that moves a body, last to first.
fn for_each_dof(data: &DataView<'_>, body: usize, mut each: impl FnMut(usize)) {
    let model = data.model();
    let mut dof = last_dof(model, body);
    while let Ok(at) = usize::try_from(dof) {
        each(at);
        dof = model.dof_parentid()[at];
    }
}

/// Generalised force of a force and torque at a point of a body, all in the world.
fn generalised_force(
    data: &DataView<'_>,
    body: usize,
    dof: usize,
    at: Vector3<f64>,
    force: Vector3<f64>,
    torque: Vector3<f64>,
) -> f64 {
    let root = data.model().body_rootid()[body] as usize;
    let arm = at - vector(data.subtree_com(), root);
    let axis = &data.cdof()[6 * dof..6 * dof + 6];
    Vector3::new(axis[0], axis[1], axis[2]).dot(&(torque + arm.cross(&force)))
        + Vector3::new(axis[3], axis[4], axis[5]).dot(&force)
}

/// Forces of moving water on bodies, beside the relative velocity that other effects see: the pressure
/// that accelerates the water (Froude-Krylov) on all that displaces it, as far as it is submerged, and the change of MuJoCo's own
/// fluid, which knows a constant wind only. `each` gets body, point, force and torque there, in the world.
fn moving_water(
    data: &DataView<'_>,
    water: &Water<'_>,
    mut each: impl FnMut(usize, Vector3<f64>, Vector3<f64>, Vector3<f64>),
) {
    // Every bound that moves the water knows all that displaces it.
    let knows = water
        .sources
        .iter()
        .find(|source| !source.bound.water.is_empty());
    if let Some(source) = knows {
        for displacing in &source.bound.displacing {
            let (at, mass) = displaced(data, source, displacing, water.time);
            let rate = water.acceleration(at);
            each(displacing.body, at, rate * mass, Vector3::zeros());
        }
    }
    for source in water.sources {
        for displacing in &source.bound.in_waves {
            let (at, mass) = displaced(data, source, displacing, water.time);
            let rate = water.own(source, at).acceleration;
            each(displacing.body, at, rate * mass, Vector3::zeros());
        }
    }
    if !data.model().has_fluid() {
        return;
    }
    let wind = water.wind;
    for body in 1..data.model().bodies() {
        fluid_loads::loads(
            data,
            body,
            |at| wind + water.added(at),
            |at, force, torque| each(body, at, force, torque),
        );
        fluid_loads::loads(
            data,
            body,
            |_| wind,
            |at, force, torque| each(body, at, -force, -torque),
        );
    }
}

/// Centre in the world [m] and mass [kg] of the water that a body displaces.
fn displaced(
    data: &DataView<'_>,
    source: &Source<'_>,
    displacing: &Displacing,
    time: f64,
) -> (Vector3<f64>, f64) {
    let rotation = rotation(data.xmat(), displacing.body);
    let origin = vector(data.xpos(), displacing.body);
    let sea = &source.bound.sea;
    if sea.waterline.is_none() {
        let middle = Vector3::from(displacing.middle);
        return (origin + rotation * middle, displacing.mass);
    }
    let (fraction, middle) = wet_part(&displacing.hull, sea, &rotation, &origin, time);
    let centre = displacing.centre.map_or(middle, Vector3::from);
    (origin + rotation * centre, displacing.mass * fraction)
}

/// Forces of effects on the bodies at and below `root`, with the accelerations of `data`:
/// `each` gets a point, and force and torque there, in the world. Sources before the `first` count for the
/// motion of the water only.
pub(crate) fn on_subtree(
    data: &DataView<'_>,
    sources: &[Source<'_>],
    root: usize,
    first: usize,
    mut each: impl FnMut(Vector3<f64>, Vector3<f64>, Vector3<f64>),
) {
    let model = data.model();
    let water = Water::new(data, sources);
    for source in &sources[first.min(sources.len())..] {
        for wet in &source.bound.bodies {
            if !model.hangs_below(wet.body, root) {
                continue;
            }
            let load = body_load(data, source, &water, wet);
            let mut wrench = load.wrench;
            if let Some(implicit) = &load.implicit {
                wrench -= implicit * load.frame.along(wet, data.qacc());
            }
            let rotation = &load.frame.rotation;
            let (force, torque) = halves(&wrench);
            each(load.frame.origin, rotation * force, rotation * torque);
        }
    }
    if water.moves() {
        moving_water(data, &water, |body, at, force, torque| {
            if model.hangs_below(body, root) {
                each(at, force, torque);
            }
        });
    }
}

/// The wrench of effects on one body, without the part that is proportional to acceleration, base frame.
pub(crate) fn on_body(data: &DataView<'_>, sources: &[Source<'_>], body: usize) -> [f64; 6] {
    let water = Water::new(data, sources);
    let mut sum = Vector6::zeros();
    for source in sources {
        for wet in source.bound.bodies.iter().filter(|wet| wet.body == body) {
            sum += body_load(data, source, &water, wet).wrench;
        }
        let of_body = |displacing: &&Displacing| displacing.body == body;
        for displacing in source.bound.in_waves.iter().filter(of_body) {
            let (at, mass) = displaced(data, source, displacing, water.time);
            let force = water.own(source, at).acceleration * mass;
            let arm = at - vector(data.xpos(), body);
            let frame = rotation(data.xmat(), body);
            let (force, torque) = (frame.tr_mul(&force), frame.tr_mul(&arm.cross(&force)));
            sum += Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        }
    }
    sum.into()
}

fn halves(wrench: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (
        Vector3::new(wrench[0], wrench[1], wrench[2]),
        Vector3::new(wrench[3], wrench[4], wrench[5]),
    )
}

/// Velocity that effects and the sea of a source add to the water at a point and time, world [m/s].
pub(crate) fn added_water(
    data: &DataView<'_>,
    sources: &[Source<'_>],
    which: Option<usize>,
    at: [f64; 3],
    time: f64,
) -> [f64; 3] {
    let water = Water::new(data, sources).at_time(time);
    let at = Vector3::from(at);
    let own = which.map_or_else(Vector3::zeros, |which| {
        water.own(&sources[which], at).velocity
    });
    (water.added(at) + own).into()
}

/// Brings the memory of a source over the step that `data` has just made: bodies from the motion at its
/// start, which MuJoCo's derived fields still have (under Runge-Kutta: that of the last stage), joints
/// from the state at its end, actuators from their command.
pub(crate) fn advance_memory(
    data: &DataView<'_>,
    sources: &[Source<'_>],
    which: usize,
    memory: &mut [f64],
) {
    let source = &sources[which];
    if source.bound.memory_len == 0 {
        return;
    }
    let step = data.model().raw().opt.timestep;
    let water = Water::new(data, sources).at_time(data.time() - step);
    for wet in &source.bound.bodies {
        let remembers = wet.acting.iter().any(|acting| !acting.memory.is_empty());
        if !remembers && wet.potential_flow.is_none() {
            continue;
        }
        let frame = Frame::new(data, wet);
        let (mut motion, _) = motion(data, source, &water, wet, &frame);
        for acting in &wet.acting {
            if let Some(part) = acting.body() {
                let memory = &mut memory[acting.memory.clone()];
                motion.commands = commands(data, acting);
                part.advance(&acting.parameters, &motion, step, memory);
            }
        }
        if let Some(radiating) = &wet.potential_flow {
            let on = (wet, radiating);
            potential_flow::advance(data, source, &water, on, (&frame, &motion), memory);
        }
    }
    for joint in &source.bound.joints {
        let Acting {
            parameters,
            memory: range,
            ..
        } = &joint.acting;
        if let Some(part) = joint.acting.joint() {
            let motion = joint_motion(data, joint);
            part.advance(parameters, &motion, step, &mut memory[range.clone()]);
        }
    }
    let first = sea_memory_start(source.bound, memory);
    source.bound.sea.advance(&mut memory[first..], step);
    if !source.commands_arrived {
        for changed in &source.bound.actuators {
            actuation::arriving(changed, data.ctrl()[changed.control], step, memory);
        }
    }
}
