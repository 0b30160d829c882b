//! Sizes of the thing that an effect acts on: priors and bounds depend on them.

use super::{body_scale::BodyScale, joint_scale::JointScale};

/// The thing acted on, with the sizes that priors and bounds depend on.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// A body; where it is the root of a tree, with the whole tree.
    Body(BodyScale),
    /// A joint.
    Joint(JointScale),
    /// An actuator.
    Actuator(ActuatorScale),
    /// A sensor.
    Sensor(SensorScale),
}

impl Target {
    /// The sizes of the body, if it is one.
    pub(crate) fn body(&self) -> Option<&BodyScale> {
        match self {
            Self::Body(scale) => Some(scale),
            _ => None,
        }
    }
}

/// Sizes of an actuator.
#[derive(Clone, Debug, PartialEq)]
pub struct ActuatorScale {
    /// Largest command in the trials.
    pub command: f64,
    /// Typical inflow speed along its thrust [m/s].
    pub inflow: f64,
    /// Step of the model [s].
    pub step: f64,
    /// True where it pushes at a site, as a thruster does.
    pub thrusts: bool,
}

/// Sizes of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorScale {
    /// Numbers that it reports; three for an attitude (rotation vector).
    pub dimension: usize,
    /// Standard deviation of its noise, in its unit.
    pub noise: f64,
    /// Root mean square of its readings, in its unit.
    pub signal: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Sample period [s].
    pub period: f64,
    /// True where it reports a rotation.
    pub attitude: bool,
}
