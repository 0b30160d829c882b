//! Potential flow about a hull in a simulation: added mass, the memory of waves made, and the force of waves met.

use hydro_effects::{Id, Motion, effect};
use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};

use super::{frame::Frame, source::Source, submersion::Submersion, water::Water};
use crate::{
    mujoco::{bodies::fluid_loads, ffi::DataView},
    plugin::bound::{Radiating, WetBody},
};

/// Load of the flow on a body, in its frame about its origin.
pub(super) struct FlowLoad {
    /// Without the part that is proportional to acceleration.
    pub(super) wrench: Vector6<f64>,
    pub(super) inertia: Matrix6<f64>,
}

/// A body's motion as its potential flow takes it: relative to the current, in a sea without waves, whose force is another term.
fn calm(
    data: &DataView<'_>,
    source: &Source<'_>,
    water: &Water<'_>,
    wet: &WetBody,
    frame: &Frame,
    motion: &Motion,
) -> Motion {
    let (linear, _) = fluid_loads::velocity(data, wet.body, frame.origin);
    let relative = linear - water.without_waves(source, frame.origin);
    Motion {
        linear: frame.rotation.tr_mul(&relative).into(),
        water_acceleration: [0.0; 3],
        ..motion.clone()
    }
}

/// Velocity of the point that the flow is about [m/s, rad/s], body frame.
fn velocity(radiating: &Radiating, calm: &Motion) -> Vector6<f64> {
    let angular = Vector3::from(calm.angular);
    let linear = Vector3::from(calm.linear) + angular.cross(&Vector3::from(radiating.flow.point));
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// Part of the volume at the draught below which the load fades with the submerged volume: linear theory knows no hull that
/// leaves the water.
const HARDLY_AFLOAT: f64 = 0.5;

/// The load: that of the draught, fading where less than half of that volume is under water.
pub(super) fn load(
    data: &DataView<'_>,
    source: &Source<'_>,
    water: &Water<'_>,
    (wet, radiating): (&WetBody, &Radiating),
    frame: &Frame,
    motion: &Motion,
    submersion: &Submersion,
) -> FlowLoad {
    let flow = &radiating.flow;
    let wet_part = submersion.fraction * wet.hull.volume() / flow.volume;
    let share = (wet_part / HARDLY_AFLOAT).min(1.0);
    let calm = calm(data, source, water, wet, frame, motion);
    let mut values = [0.0; hydro_effects::MATRIX_AT_POINT_LEN];
    let (elements, point) = values.split_at_mut(hydro_effects::MATRIX_LEN);
    elements.copy_from_slice(flow.added_mass.as_slice());
    point.copy_from_slice(&flow.point);
    let mut wrench = Vector6::zeros();
    let mut inertia = Matrix6::zeros();
    if let Some(part) = effect(Id::AddedMass).matrix_part() {
        wrench += Vector6::from(part.wrench(&values, &calm, &[]));
        inertia += part.inertia(&values, &calm).unwrap_or_default();
    }
    let mut force = flow.radiation_force(&source.memory[radiating.memory.clone()]);
    if let Some(waves) = &source.bound.sea.waves {
        let at = frame.origin + frame.rotation * Vector3::from(flow.point);
        let heading = frame.rotation[(1, 0)].atan2(frame.rotation[(0, 0)]);
        let pushed = flow.excitation_force(waves, [at.x, at.y], heading, water.time);
        let to_body = frame.rotation.transpose()
            * Rotation3::from_axis_angle(&Vector3::z_axis(), heading).matrix();
        let [linear, angular] = [0, 3].map(|from| to_body * pushed.fixed_rows::<3>(from));
        force += Vector6::new(
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        );
    }
    let lever = Vector3::from(flow.point).cross(&force.fixed_rows::<3>(0).into_owned());
    wrench += force;
    for axis in 0..3 {
        wrench[3 + axis] += lever[axis];
    }
    FlowLoad {
        wrench: wrench * share,
        inertia: inertia * share,
    }
}

/// Brings the memory of a body's flow over a step [s].
pub(super) fn advance(
    data: &DataView<'_>,
    source: &Source<'_>,
    water: &Water<'_>,
    (wet, radiating): (&WetBody, &Radiating),
    (frame, motion): (&Frame, &Motion),
    memory: &mut [f64],
) {
    let calm = calm(data, source, water, wet, frame, motion);
    let step = data.model().raw().opt.timestep;
    let known = radiating.stepping.as_ref();
    // A step that was changed after compiling is made anew each time.
    let other = match known {
        Some(stepping) if stepping.step == step => None,
        _ => radiating.flow.stepping(step),
    };
    if let Some(stepping) = other.as_ref().or(known) {
        let memory = &mut memory[radiating.memory.clone()];
        // The velocity in the middle of the step, from that at its start.
        let change = frame.along(wet, data.qacc()) * (0.5 * step);
        let mut middle = calm;
        for axis in 0..3 {
            middle.linear[axis] += change[axis];
            middle.angular[axis] += change[axis + 3];
        }
        stepping.advance(&velocity(radiating, &middle), memory);
    }
}
