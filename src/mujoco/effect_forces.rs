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
//! A thus acts as effective mass, exactly, whatever it is beside the body's own; the drag is linearly
//! implicit, so that none is too stiff for a light body. The sum goes into MuJoCo's inertia matrix in
//! the passive stage, made anew each time, so that constraints, integrators and accelerometers know it.
//! Inverse dynamics, which MuJoCo does without that matrix, does not.

use hydro_effects::{Id, Motion};
use hydro_frames as frames;
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use super::{
    actuation,
    apply::{rotation, vector},
    bindings::mjDSBL_GRAVITY,
    native, run,
    views::{DataView, ModelView},
    walls,
    water::Water,
    wrench,
};
use crate::plugin::{
    Bound,
    bound::{Acting, WetBody},
};

/// Effects whose force turns with the body's own motion and resists nothing: the derivative is no drag,
/// and an implicit step with it would only be less exact.
const GYROSCOPIC: [Id; 3] = [Id::AddedMass, Id::Payload, Id::MunkMoment];

/// Effects with their memory.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) bound: &'a Bound,
    pub(super) memory: &'a [f64],
    /// True where commands were changed before the step, so that `ctrl` has what arrives.
    pub(super) commands_arrived: bool,
}

/// A body's frame in motion.
struct Frame {
    rotation: Matrix3<f64>,
    /// Velocity of the body [6] by each of its degrees of freedom, body frame: linear, angular.
    columns: Vec<Vector6<f64>>,
    origin: Vector3<f64>,
    /// Origin from the point that MuJoCo's spatial vectors are about.
    arm: Vector3<f64>,
}

impl Frame {
    fn new(data: &DataView<'_>, wet: &WetBody) -> Self {
        let rotation = rotation(data.xmat(), wet.body);
        let root = data.model().body_rootid()[wet.body] as usize;
        let origin = vector(data.xpos(), wet.body);
        let arm = origin - vector(data.subtree_com(), root);
        let columns = wet
            .dofs
            .iter()
            .map(|dof| to_body(&rotation, arm, &data.cdof()[6 * dof..6 * dof + 6]))
            .collect();
        Self {
            rotation,
            columns,
            origin,
            arm,
        }
    }

    /// J x [6].
    fn along(&self, wet: &WetBody, x: &[f64]) -> Vector6<f64> {
        self.columns
            .iter()
            .zip(&wet.dofs)
            .fold(Vector6::zeros(), |sum, (column, dof)| {
                sum + column * x[*dof]
            })
    }
}

/// A spatial vector of MuJoCo's (rotation, translation about the tree's centre of mass, world) as linear
/// and angular part at the body's origin, body frame.
fn to_body(rotation: &Matrix3<f64>, arm: Vector3<f64>, spatial: &[f64]) -> Vector6<f64> {
    let angular = Vector3::new(spatial[0], spatial[1], spatial[2]);
    let linear = Vector3::new(spatial[3], spatial[4], spatial[5]) + angular.cross(&arm);
    let (linear, angular) = (rotation.tr_mul(&linear), rotation.tr_mul(&angular));
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// What a body gets from its effects.
struct BodyLoad<'a> {
    wet: &'a WetBody,
    frame: Frame,
    /// Wrench without the part that is proportional to acceleration.
    wrench: Vector6<f64>,
    /// A + h D.
    implicit: Option<Matrix6<f64>>,
}

fn body_load<'a>(
    data: &DataView<'_>,
    source: &Source<'a>,
    water: &Water<'_>,
    wet: &'a WetBody,
) -> BodyLoad<'a> {
    let frame = Frame::new(data, wet);
    let motion = motion(data, source.bound, water, wet, &frame);
    let mut wrench = Vector6::zeros();
    let mut inertia: Option<Matrix6<f64>> = None;
    let mut damping: Option<Matrix6<f64>> = None;
    for acting in &wet.acting {
        let Some(part) = acting.body() else { continue };
        let memory = &source.memory[acting.memory.clone()];
        wrench += Vector6::from(part.wrench(&acting.parameters, &motion, memory));
        if let Some(more) = part.inertia(&acting.parameters, &motion) {
            inertia = Some(inertia.unwrap_or_default() + more);
        }
        if !data.model().runge_kutta()
            && !GYROSCOPIC.contains(&acting.effect.card().id)
            && let Some(more) = part.damping(&acting.parameters, &motion, memory)
        {
            damping = Some(damping.unwrap_or_default() + more);
        }
    }
    if let Some(inertia) = &inertia {
        wrench -= inertia * bias(data, wet, &frame);
    }
    let step = data.model().raw().opt.timestep;
    let implicit = match (inertia, damping.map(|damping| resisting(&damping) * step)) {
        (Some(a), Some(d)) => Some(a + d),
        (a, d) => a.or(d),
    };
    BodyLoad {
        wet,
        frame,
        wrench,
        implicit,
    }
}

/// The acceleration of the body's origin as the world sees it, and its angular acceleration, in the
/// directions of its frame, where no degree of freedom accelerates.
fn bias(data: &DataView<'_>, wet: &WetBody, frame: &Frame) -> Vector6<f64> {
    let mut bias = wet.dofs.iter().fold(Vector6::zeros(), |sum, dof| {
        let axis = &data.cdof_dot()[6 * dof..6 * dof + 6];
        sum + to_body(&frame.rotation, frame.arm, axis) * data.qvel()[*dof]
    });
    // From the spatial acceleration to that of the origin.
    let (linear, angular) = native::velocity(data, wet.body, frame.origin);
    let carried = frame.rotation.tr_mul(&angular.cross(&linear));
    for axis in 0..3 {
        bias[axis] += carried[axis];
    }
    bias
}

/// Relative to the largest, an eigenvalue above minus this is zero.
const ROUNDING: f64 = 1e-9;

/// The part of a damping matrix that resists: symmetric, without negative eigenvalues. The implicit step
/// is of first order with any, and stable with this. Where a force across the motion (lift) makes it indefinite,
/// what every axis resists by itself: the positive eigenvalues alone would slow an axis that feels no force.
fn resisting(damping: &Matrix6<f64>) -> Matrix6<f64> {
    let symmetric = (damping + damping.transpose()) * 0.5;
    if symmetric.cholesky().is_some() {
        return symmetric;
    }
    if !symmetric.iter().all(|value| value.is_finite()) {
        return Matrix6::zeros();
    }
    let eigenvalues = symmetric.symmetric_eigenvalues();
    if eigenvalues.min() >= -ROUNDING * eigenvalues.amax() {
        return symmetric;
    }
    Matrix6::from_diagonal(&symmetric.diagonal().map(|value| value.max(0.0)))
}

fn motion(
    data: &DataView<'_>,
    bound: &Bound,
    water: &Water<'_>,
    wet: &WetBody,
    frame: &Frame,
) -> Motion {
    let model = data.model();
    let (linear, angular) = native::velocity(data, wet.body, frame.origin);
    let relative = linear - water.velocity(bound, frame.origin);
    let centre = if wet.root {
        let centre = vector(data.subtree_com(), wet.body) - frame.origin;
        frame.rotation.tr_mul(&centre)
    } else {
        vector(model.body_ipos(), wet.body)
    };
    let option = &model.raw().opt;
    let gravity_is_on = option.disableflags & mjDSBL_GRAVITY as i32 == 0;
    let attitude: UnitQuaternion<f64> =
        frames::world_from_base(ModelView::quadruple(data.xquat(), wet.body));
    Motion {
        time: water.time,
        position: frame.origin.into(),
        world_from_base: attitude,
        linear: frame.rotation.tr_mul(&relative).into(),
        angular: frame.rotation.tr_mul(&angular).into(),
        water_acceleration: water.acceleration(frame.origin).into(),
        gravity: if gravity_is_on {
            option.gravity
        } else {
            [0.0; 3]
        },
        density: bound.density,
        centre: centre.into(),
        middle: wet.middle,
        extent: wet.extent,
        volume: wet.volume,
        depth: Some(bound.waterline - frame.origin.z),
        wall: walls::nearest(data, &bound.walls, frame.origin),
    }
}

/// Adds all effects of a simulation to `qfrc_passive` and to the inertia matrix: in the callback of the
/// last that has any, so that the matrix is made once. `instance` is the plugin instance that asks; the
/// passive callback, which comes before all instances, is none.
pub(super) fn add_once(data: &mut DataView<'_>, instance: Option<usize>) {
    let carriers = wrench::with_effects(data);
    if carriers.last().map(|last| last.id) != instance {
        return;
    }
    let mut todo = Todo::default();
    wrench::with_sources(data, &carriers, |data, sources| {
        todo.collect(data, sources);
    });
    todo.apply(data);
}

/// What is to be added, once nothing is borrowed any more.
#[derive(Default)]
struct Todo {
    forces: Vec<(usize, f64)>,
    /// Row of a degree of freedom, column by its place in that row, value.
    inertias: Vec<(usize, Place, f64)>,
    touches_inertia: bool,
}

#[derive(Clone, Copy)]
enum Place {
    /// So many entries into the row.
    Column(usize),
    Diagonal,
}

impl Todo {
    fn collect(&mut self, data: &DataView<'_>, sources: &[Source<'_>]) {
        let model = data.model();
        let water = Water::new(data, sources);
        let step = model.raw().opt.timestep;
        for source in sources {
            for wet in &source.bound.bodies {
                let load = body_load(data, source, &water, wet);
                self.add_body(&load);
            }
            for joint in &source.bound.joints {
                let Some(part) = joint.acting.joint() else {
                    continue;
                };
                let (position, velocity) = (data.qpos()[joint.qpos], data.qvel()[joint.dof]);
                let parameters = &joint.acting.parameters;
                let memory = &source.memory[joint.acting.memory.clone()];
                let force = part.force(parameters, position, velocity, memory);
                self.forces.push((joint.dof, force));
                self.touches_inertia = true;
                if !model.runge_kutta() {
                    let damping = part.damping(parameters, position, velocity, memory);
                    self.inertias
                        .push((joint.dof, Place::Diagonal, step * damping.max(0.0)));
                }
            }
            for changed in &source.bound.actuators {
                let more = actuation::correction(data, source, changed, |at| {
                    water.velocity(source.bound, at)
                });
                actuation::in_joint_space(data, changed.output, more, &mut self.forces);
            }
        }
        if let Some(run) = run::current() {
            self.add_buoyancy_torques(data, &run.moved_centres);
        }
        if water.has_effects() {
            moving_water(data, &water, |body, at, force, torque| {
                for_each_dof(data, body, |dof| {
                    let power = power_of(data, body, dof, at, force, torque);
                    self.forces.push((dof, power));
                });
            });
        }
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
                let power = power_of(data, *body, dof, at, Vector3::zeros(), torque);
                self.forces.push((dof, power));
            });
        }
    }

    fn apply(self, data: &mut DataView<'_>) {
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

/// Calls with every degree of freedom that moves a body, last to first.
fn for_each_dof(data: &DataView<'_>, body: usize, mut each: impl FnMut(usize)) {
    let model = data.model();
    let mut dof = super::apply::last_dof(model, body);
    while let Ok(at) = usize::try_from(dof) {
        each(at);
        dof = model.dof_parentid()[at];
    }
}

/// Generalised force of a force and torque at a point of a body, all in the world.
fn power_of(
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

/// What effects on the water do to bodies beside the relative velocity of other effects: the pressure
/// that accelerates the water (Froude-Krylov) on all that displaces it, and the change of MuJoCo's own
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
    for displacing in knows.map_or(&[][..], |source| &source.bound.displacing) {
        let rotation = rotation(data.xmat(), displacing.body);
        let at = vector(data.xpos(), displacing.body) + rotation * Vector3::from(displacing.middle);
        let rate = water.acceleration(at);
        each(
            displacing.body,
            at,
            rate * displacing.mass,
            Vector3::zeros(),
        );
    }
    if !data.model().has_fluid() {
        return;
    }
    let wind = water.wind;
    for body in 1..data.model().bodies() {
        native::loads(
            data,
            body,
            |at| wind + water.added(at),
            |at, force, torque| each(body, at, force, torque),
        );
        native::loads(
            data,
            body,
            |_| wind,
            |at, force, torque| each(body, at, -force, -torque),
        );
    }
}

/// What effects put on the bodies that hang below and at `root`, with the accelerations of `data`:
/// `each` gets a point, and force and torque there, in the world. Sources before the `first` count for the
/// motion of the water only.
pub(super) fn on_subtree(
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
    if water.has_effects() {
        moving_water(data, &water, |body, at, force, torque| {
            if model.hangs_below(body, root) {
                each(at, force, torque);
            }
        });
    }
}

/// The wrench of effects on one body, without the part that is proportional to acceleration, base frame.
pub(super) fn on_body(data: &DataView<'_>, sources: &[Source<'_>], body: usize) -> [f64; 6] {
    let water = Water::new(data, sources);
    let mut sum = Vector6::zeros();
    for source in sources {
        for wet in source.bound.bodies.iter().filter(|wet| wet.body == body) {
            sum += body_load(data, source, &water, wet).wrench;
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

/// Velocity that effects add to the water at a point and time, world [m/s].
pub(super) fn added_water(
    data: &DataView<'_>,
    sources: &[Source<'_>],
    at: [f64; 3],
    time: f64,
) -> [f64; 3] {
    let water = Water::new(data, sources).at_time(time);
    water.added(Vector3::from(at)).into()
}

/// Brings the memory of a source over the step that `data` has just made: bodies from the motion at its
/// start, which MuJoCo's derived fields still have (under Runge-Kutta: that of the last stage), joints
/// from the state at its end, actuators from their command.
pub(super) fn advanced(
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
        if wet.acting.iter().all(|acting| acting.memory.is_empty()) {
            continue;
        }
        let frame = Frame::new(data, wet);
        let motion = motion(data, source.bound, &water, wet, &frame);
        for acting in &wet.acting {
            if let Some(part) = acting.body() {
                let memory = &mut memory[acting.memory.clone()];
                part.advance(&acting.parameters, &motion, step, memory);
            }
        }
    }
    for joint in &source.bound.joints {
        let Acting {
            parameters,
            memory: range,
            ..
        } = &joint.acting;
        if let Some(part) = joint.acting.joint() {
            let (position, velocity) = (data.qpos()[joint.qpos], data.qvel()[joint.dof]);
            part.advance(
                parameters,
                position,
                velocity,
                step,
                &mut memory[range.clone()],
            );
        }
    }
    if !source.commands_arrived {
        for changed in &source.bound.actuators {
            actuation::arriving(changed, data.ctrl()[changed.control], step, memory);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lift in a straight fall: the force is zero, its derivative is all off the diagonal.
    #[test]
    fn what_acts_across_the_motion_does_not_resist() {
        let mut lift = Matrix6::zeros();
        lift[(2, 0)] = -320.0;
        assert_eq!(resisting(&lift), Matrix6::zeros());
        lift[(2, 2)] = 5.0;
        lift[(4, 4)] = -1.0;
        assert_eq!(resisting(&lift)[(2, 2)], 5.0);
        assert_eq!(resisting(&lift)[(4, 4)], 0.0);
    }

    /// Drag off the origin: singular, but whole.
    #[test]
    fn what_resists_at_a_lever_is_kept_whole() {
        let mut arm = Matrix6::zeros();
        (arm[(2, 2)], arm[(2, 4)], arm[(4, 2)], arm[(4, 4)]) = (8.0, -4.0, -4.0, 2.0);
        assert_eq!(resisting(&arm), arm);
    }
}
