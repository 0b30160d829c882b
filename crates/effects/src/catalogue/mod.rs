//! Every effect that is built in, one a file, and the way to an effect by its name.

pub mod actuator_deadband;
pub mod actuator_delay;
pub mod actuator_gain;
pub mod actuator_lag;
pub mod added_mass;
mod axes;
pub mod basset_history;
pub mod buoyancy_offset;
pub mod constant_force;
mod coupling;
pub mod cross_flow_drag;
pub mod current;
pub(crate) mod ellipsoid;
pub mod fin;
pub mod free_surface;
pub mod hydrostatics;
pub mod inflow_thrust_loss;
pub mod joint_armature;
pub mod joint_backlash;
pub mod joint_damping;
pub mod joint_friction;
pub mod joint_stiffness;
pub mod lift;
pub mod linear_drag;
pub mod munk_moment;
pub mod net_buoyancy;
pub mod payload;
pub mod propeller;
mod proximity;
pub mod quadratic_drag;
pub mod sensor_bias;
pub mod sensor_delay;
pub mod sensor_scale;
pub mod thrust_curve;
pub mod wake_memory;
pub mod wall_proximity;
pub mod waves;
mod whole_matrix;
pub mod windage;

pub(crate) use axes::NAMES as AXES;

use crate::{Effect, Id, Target, card::BodyScale, own::registry};

/// The effect of a name.
pub fn effect(id: Id) -> &'static dyn Effect {
    match id {
        Id::AddedMass => &added_mass::AddedMass,
        Id::LinearDrag => &linear_drag::LinearDrag,
        Id::QuadraticDrag => &quadratic_drag::QuadraticDrag,
        Id::CrossFlowDrag => &cross_flow_drag::CrossFlowDrag,
        Id::Current => &current::Current,
        Id::MunkMoment => &munk_moment::MunkMoment,
        Id::Lift => &lift::Lift,
        Id::Fin => &fin::Fin,
        Id::Propeller => &propeller::Propeller,
        Id::Windage => &windage::Windage,
        Id::NetBuoyancy => &net_buoyancy::NetBuoyancy,
        Id::BuoyancyOffset => &buoyancy_offset::BuoyancyOffset,
        Id::Payload => &payload::Payload,
        Id::WakeMemory => &wake_memory::WakeMemory,
        Id::BassetHistory => &basset_history::BassetHistory,
        Id::Hydrostatics => &hydrostatics::Hydrostatics,
        Id::FreeSurface => &free_surface::FreeSurface,
        Id::WallProximity => &wall_proximity::WallProximity,
        Id::Waves => &waves::Waves,
        Id::ActuatorGain => &actuator_gain::ActuatorGain,
        Id::ActuatorDeadband => &actuator_deadband::ActuatorDeadband,
        Id::ActuatorLag => &actuator_lag::ActuatorLag,
        Id::ActuatorDelay => &actuator_delay::ActuatorDelay,
        Id::ThrustCurve => &thrust_curve::ThrustCurve,
        Id::InflowThrustLoss => &inflow_thrust_loss::InflowThrustLoss,
        Id::JointFriction => &joint_friction::JointFriction,
        Id::JointDamping => &joint_damping::JointDamping,
        Id::JointArmature => &joint_armature::JointArmature,
        Id::JointStiffness => &joint_stiffness::JointStiffness,
        Id::JointBacklash => &joint_backlash::JointBacklash,
        Id::SensorBias => &sensor_bias::SensorBias,
        Id::SensorDelay => &sensor_delay::SensorDelay,
        Id::SensorScale => &sensor_scale::SensorScaling,
        Id::ConstantForce => &constant_force::ConstantForce,
        Id::Own(own) => registry::effect(own),
    }
}

/// True where a file may leave a parameter of an effect out, whatever the target's sizes.
pub fn is_optional(id: Id, parameter: &str) -> bool {
    // Only effects on bodies have such parameters.
    let body = Target::Body(BodyScale::ONE);
    let parameters = effect(id).parameters(&body);
    parameters
        .iter()
        .any(|known| known.optional && known.name == parameter)
}

/// All that are built in, in the order of [`Id::ALL`].
pub fn all() -> impl Iterator<Item = &'static dyn Effect> {
    Id::ALL.iter().map(|&id| effect(id))
}
