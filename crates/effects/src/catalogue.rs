//! Every effect by its name.

use super::{
    Effect, Id, Target, actuator_deadband, actuator_delay, actuator_gain, actuator_lag, added_mass,
    basset_history, buoyancy_offset, card::BodyScale, constant_force, cross_flow_drag, current,
    free_surface, inflow_thrust_loss, joint_backlash, joint_damping, joint_friction,
    joint_stiffness, lift, linear_drag, munk_moment, net_buoyancy, payload, quadratic_drag,
    sensor_bias, sensor_delay, sensor_scale, wake_memory, wall_proximity, waves,
};

/// The effect of a name.
pub fn effect(id: Id) -> &'static dyn Effect {
    match id {
        Id::AddedMass => &added_mass::EFFECT,
        Id::LinearDrag => &linear_drag::EFFECT,
        Id::QuadraticDrag => &quadratic_drag::EFFECT,
        Id::CrossFlowDrag => &cross_flow_drag::EFFECT,
        Id::Current => &current::EFFECT,
        Id::MunkMoment => &munk_moment::EFFECT,
        Id::Lift => &lift::EFFECT,
        Id::NetBuoyancy => &net_buoyancy::EFFECT,
        Id::BuoyancyOffset => &buoyancy_offset::EFFECT,
        Id::Payload => &payload::EFFECT,
        Id::WakeMemory => &wake_memory::EFFECT,
        Id::BassetHistory => &basset_history::EFFECT,
        Id::FreeSurface => &free_surface::EFFECT,
        Id::WallProximity => &wall_proximity::EFFECT,
        Id::Waves => &waves::EFFECT,
        Id::ActuatorGain => &actuator_gain::EFFECT,
        Id::ActuatorDeadband => &actuator_deadband::EFFECT,
        Id::ActuatorLag => &actuator_lag::EFFECT,
        Id::ActuatorDelay => &actuator_delay::EFFECT,
        Id::InflowThrustLoss => &inflow_thrust_loss::EFFECT,
        Id::JointFriction => &joint_friction::EFFECT,
        Id::JointDamping => &joint_damping::EFFECT,
        Id::JointStiffness => &joint_stiffness::EFFECT,
        Id::JointBacklash => &joint_backlash::EFFECT,
        Id::SensorBias => &sensor_bias::EFFECT,
        Id::SensorDelay => &sensor_delay::EFFECT,
        Id::SensorScale => &sensor_scale::EFFECT,
        Id::ConstantForce => &constant_force::EFFECT,
    }
}

/// True where a file may leave a parameter of an effect out: what is optional does not depend on the target's sizes.
pub fn is_optional(id: Id, parameter: &str) -> bool {
    // Only effects on bodies have such parameters.
    let body = Target::Body(BodyScale {
        mass: 1.0,
        inertia: [1.0; 3],
        extent: [1.0; 3],
        volume: 1.0,
        density: 1.0,
        gravity: 1.0,
        speed: 1.0,
        rate: 1.0,
    });
    let parameters = effect(id).parameters(&body);
    parameters
        .iter()
        .any(|of| of.optional && of.name == parameter)
}

/// All of them, in the order of [`Id::ALL`].
pub fn all() -> impl Iterator<Item = &'static dyn Effect> {
    Id::ALL.iter().map(|&id| effect(id))
}
