//! Every effect by its name.

use super::{
    Effect, Id, actuator_deadband, actuator_delay, actuator_gain, actuator_lag, added_mass,
    basset_history, buoyancy_offset, constant_force, cross_flow_drag, current, free_surface,
    inflow_thrust_loss, joint_backlash, joint_damping, joint_friction, joint_stiffness, lift,
    linear_drag, munk_moment, net_buoyancy, payload, quadratic_drag, sensor_bias, sensor_delay,
    sensor_scale, wake_memory, wall_proximity, waves,
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

/// All of them, in the order of [`Id::ALL`].
pub fn all() -> impl Iterator<Item = &'static dyn Effect> {
    Id::ALL.iter().map(|&id| effect(id))
}
