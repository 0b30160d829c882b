//! The effects on one body: a wrench, an inertia, and damping for the implicit step.

use hydro_effects::{Id, Medium, Motion};
use hydro_frames as frames;
use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};

use super::{
    frame::{Frame, to_body},
    potential_flow,
    source::Source,
    submersion::{Submersion, submersion},
    walls,
    water::Water,
};
use crate::{
    mujoco::{
        bodies::{fluid_loads, joint_space::vector},
        ffi::{DataView, ModelView, bindings::mjDSBL_GRAVITY},
    },
    plugin::bound::{Acting, WetBody},
};

/// Effects whose force turns with the body's own motion and resists nothing: the derivative is no drag,
/// and an implicit step with it would only be less exact.
const GYROSCOPIC: [Id; 3] = [Id::AddedMass, Id::Payload, Id::MunkMoment];

/// The sum of the effects on one body.
pub(super) struct BodyLoad<'a> {
    pub(super) wet: &'a WetBody,
    pub(super) frame: Frame,
    /// Wrench without the part that is proportional to acceleration.
    pub(super) wrench: Vector6<f64>,
    /// A + h D.
    pub(super) implicit: Option<Matrix6<f64>>,
    /// The first effect whose force is no number: it counts as none.
    pub(super) fault: Option<Id>,
}

pub(super) fn body_load<'a>(
    data: &DataView<'_>,
    source: &Source<'a>,
    water: &Water<'_>,
    wet: &'a WetBody,
) -> BodyLoad<'a> {
    let frame = Frame::new(data, wet);
    let (mut motion, submersion) = motion(data, source, water, wet, &frame);
    let mut fault = None;
    let mut wrench = Vector6::zeros();
    let mut inertia: Option<Matrix6<f64>> = None;
    let mut damping: Option<Matrix6<f64>> = None;
    for acting in &wet.acting {
        let Some(part) = acting.body() else { continue };
        let memory = &source.memory[acting.memory.clone()];
        motion.commands = commands(data, acting);
        let own = Vector6::from(part.wrench(&acting.parameters, &motion, memory));
        if !own.iter().all(|value| value.is_finite()) {
            fault = fault.or(Some(acting.effect.card().id));
            continue;
        }
        let share = share(acting, &submersion);
        wrench += own * share;
        if let Some(more) = part.inertia(&acting.parameters, &motion) {
            inertia = Some(inertia.unwrap_or_default() + more * share);
        }
        if !data.model().runge_kutta()
            && !GYROSCOPIC.contains(&acting.effect.card().id)
            && let Some(more) = part.damping(&acting.parameters, &motion, memory)
        {
            damping = Some(damping.unwrap_or_default() + more * share);
        }
    }
    if let Some(radiating) = &wet.potential_flow {
        let on = (wet, radiating);
        let load = potential_flow::load(data, source, water, on, &frame, &motion, &submersion);
        wrench += load.wrench;
        inertia = Some(inertia.unwrap_or_default() + load.inertia);
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
        fault,
    }
}

/// Part of an effect that is left where a part of the hull is above water: what the fluid does fades with the submerged
/// volume and what the air does with the rest, what a mass does stays, and hydrostatics counts the volume itself.
fn share(acting: &Acting, submersion: &Submersion) -> f64 {
    let effect = acting.effect;
    match effect.card().id {
        Id::Windage => 1.0 - submersion.fraction,
        Id::Hydrostatics => 1.0,
        _ if effect.medium() == Medium::None => 1.0,
        _ => submersion.fraction,
    }
}

/// The commands that an effect depends on.
pub(super) fn commands(data: &DataView<'_>, acting: &Acting) -> Vec<f64> {
    let commands = acting.commands.iter();
    commands.map(|control| data.ctrl()[*control]).collect()
}

/// The acceleration of the body's origin as the world sees it, and its angular acceleration, in the
/// directions of its frame, where no degree of freedom accelerates.
fn bias(data: &DataView<'_>, wet: &WetBody, frame: &Frame) -> Vector6<f64> {
    let mut bias = wet.dofs.iter().fold(Vector6::zeros(), |sum, dof| {
        let axis = &data.cdof_dot()[6 * dof..6 * dof + 6];
        sum + to_body(&frame.rotation, frame.arm, axis) * data.qvel()[*dof]
    });
    // From the spatial acceleration to that of the origin.
    let (linear, angular) = fluid_loads::velocity(data, wet.body, frame.origin);
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

pub(super) fn motion(
    data: &DataView<'_>,
    source: &Source<'_>,
    water: &Water<'_>,
    wet: &WetBody,
    frame: &Frame,
) -> (Motion, Submersion) {
    let model = data.model();
    let bound = source.bound;
    let (linear, angular) = fluid_loads::velocity(data, wet.body, frame.origin);
    let centre = if wet.root {
        let centre = vector(data.subtree_com(), wet.body) - frame.origin;
        frame.rotation.tr_mul(&centre)
    } else {
        vector(model.body_ipos(), wet.body)
    };
    let option = &model.raw().opt;
    let gravity_is_on = option.disableflags & mjDSBL_GRAVITY as i32 == 0;
    let gravity = if gravity_is_on {
        option.gravity
    } else {
        [0.0; 3]
    };
    let attitude: UnitQuaternion<f64> =
        frames::world_from_base(ModelView::quadruple(data.xquat(), wet.body));
    let submersion = submersion(
        source,
        wet,
        &frame.rotation,
        frame.origin,
        Vector3::from(gravity),
        water,
    );
    let flow = water.wind
        + Vector3::from(bound.current)
        + water.added(frame.origin)
        + submersion.water.velocity;
    let relative = linear - flow;
    let level = bound.sea.level(frame.origin.x, frame.origin.y, water.time);
    let motion = Motion {
        time: water.time,
        position: frame.origin.into(),
        world_from_base: attitude,
        linear: frame.rotation.tr_mul(&relative).into(),
        angular: frame.rotation.tr_mul(&angular).into(),
        water_velocity: flow.into(),
        water_acceleration: (water.acceleration(frame.origin) + submersion.water.acceleration)
            .into(),
        gravity,
        density: bound.density,
        centre: centre.into(),
        middle: wet.middle,
        extent: wet.extent,
        volume: wet.volume,
        upthrust: submersion.upthrust,
        depth: Some(level.unwrap_or(0.0) - frame.origin.z),
        wall: walls::nearest(data, &bound.walls, frame.origin),
        commands: Vec::new(),
    };
    (motion, submersion)
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
