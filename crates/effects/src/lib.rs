//! The catalogue: one named physical effect a file, one trait.
//!
//! An effect is written once: the code that `hydro gap` fits is the code that `hydro.wrench` applies.
//! Forces act on a body (base-frame wrench about the body's origin), on a joint, on an actuator's
//! command or thrust, or they change what a sensor reports.

pub mod actuator_deadband;
pub mod actuator_delay;
pub mod actuator_gain;
pub mod actuator_lag;
pub mod added_mass;
mod axes;
pub mod basset_history;
mod body_scale;
pub mod buoyancy_offset;
pub mod card;
pub mod catalogue;
pub mod constant_force;
pub mod cross_flow_drag;
pub mod current;
mod ellipsoid;
#[cfg(test)]
mod fixture;
mod flow;
#[cfg(test)]
mod free_motion;
pub mod free_surface;
pub mod inflow_thrust_loss;
pub mod joint_backlash;
pub mod joint_damping;
pub mod joint_friction;
mod joint_scale;
pub mod joint_stiffness;
mod law;
pub mod lift;
pub mod linear_drag;
pub mod motion;
pub mod munk_moment;
mod nearest;
pub mod net_buoyancy;
mod parameter;
pub mod payload;
mod proximity;
pub mod quadratic_drag;
pub mod sensor_bias;
pub mod sensor_delay;
pub mod sensor_scale;
pub mod set;
pub mod set_error;
#[cfg(test)]
mod tests;
pub mod wake_memory;
pub mod wall_proximity;
pub mod waves;

pub use card::{Card, Id, Parameter, Placement, Target, TargetKind};
pub use catalogue::{all, effect};
pub use motion::Motion;
pub use set::{EffectSet, Targets};
pub use set_error::SetError;

use nalgebra::Matrix6;

/// One effect of the catalogue.
pub trait Effect: Send + Sync + std::fmt::Debug {
    /// What it is, for people and for `hydro gap effects`.
    fn card(&self) -> &'static Card;

    /// Its parameters on a target: names, units, the value that means "no effect", and the prior.
    fn parameters(&self, target: &Target) -> Vec<Parameter>;

    /// What it does.
    fn part(&self) -> Part<'_>;
}

/// What an effect does, by what it acts on.
#[derive(Clone, Copy)]
#[expect(
    missing_debug_implementations,
    reason = "the effect itself, which holds the part, has one"
)]
pub enum Part<'a> {
    /// A wrench on a body.
    Body(&'a dyn BodyPart),
    /// Motion of the water itself: it enters the relative velocity of the nominal's own fluid and of
    /// every other effect.
    Water(&'a dyn WaterPart),
    /// A generalised force on a hinge or slide.
    Joint(&'a dyn JointPart),
    /// A change of what an actuator is told or gives.
    Actuator(&'a dyn ActuatorPart),
    /// A change of what a sensor reports.
    Sensor(&'a dyn SensorPart),
}

/// A wrench on a body. `p` are the parameters in the order of [`Effect::parameters`].
pub trait BodyPart {
    /// Numbers of memory that it keeps in plugin state.
    fn memory_len(&self) -> usize {
        0
    }

    /// Force [N] and torque [N m] about the body's origin, in the body's frame; without the part that
    /// is proportional to acceleration (that is [`BodyPart::inertia`]).
    fn wrench(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> [f64; 6];

    /// What is added to the body's inertia [kg, kg m, kg m^2], (linear, angular) about its origin in its
    /// frame: applied implicitly, as effective mass. Symmetric, positive semidefinite.
    ///
    /// It multiplies the acceleration of the origin as seen from the world and the angular acceleration,
    /// both expressed in the body's frame: with J the Jacobian of (linear, angular) velocity in that
    /// frame's directions, `J qacc + (dJ/dt) qvel` where the directions are held fixed in the world during the
    /// differentiation. (Not Fossen's derivative of body-frame components, which lacks omega x v: that part
    /// is in [`BodyPart::wrench`].) For a free body this is just `J qacc`.
    fn inertia(&self, _p: &[f64], _motion: &Motion) -> Option<Matrix6<f64>> {
        None
    }

    /// `-d wrench / d (linear, angular velocity)`, for the implicit step of stiff drag.
    fn damping(&self, _p: &[f64], _motion: &Motion, _memory: &[f64]) -> Option<Matrix6<f64>> {
        None
    }

    /// `d wrench / d p`, a column a parameter.
    fn by_parameters(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Vec<[f64; 6]>;

    /// Brings the memory over a step [s] that starts at `motion`.
    fn advance(&self, _p: &[f64], _motion: &Motion, _step: f64, _memory: &mut [f64]) {}
}

/// Motion of the water.
pub trait WaterPart {
    /// Velocity of the water in the world [m/s] at a point [m] and a time [s].
    fn velocity(&self, p: &[f64], position: [f64; 3], time: f64) -> [f64; 3];

    /// Acceleration of the water in the world [m/s^2] at a point [m] and a time [s]. It goes into
    /// [`Motion::water_acceleration`], and every wet body feels its pressure, [`Motion::froude_krylov`].
    fn acceleration(&self, _p: &[f64], _position: [f64; 3], _time: f64) -> [f64; 3] {
        [0.0; 3]
    }
}

/// A generalised force on a hinge [N m] or slide [N].
pub trait JointPart {
    /// Numbers of memory that it keeps.
    fn memory_len(&self) -> usize {
        0
    }

    /// The force at a joint position [rad or m] and velocity [rad/s or m/s].
    fn force(&self, p: &[f64], position: f64, velocity: f64, memory: &[f64]) -> f64;

    /// `-d force / d velocity`, for the implicit step.
    fn damping(&self, p: &[f64], position: f64, velocity: f64, memory: &[f64]) -> f64;

    /// Brings the memory over a step [s].
    fn advance(&self, _p: &[f64], _position: f64, _velocity: f64, _step: f64, _memory: &mut [f64]) {
    }

    /// Play [rad or m] that the joint has: the simulator puts a joint, limited to half of it on either
    /// side, in series behind this one.
    fn play(&self, _p: &[f64]) -> Option<f64> {
        None
    }
}

/// A change of an actuator, between the logged command and the force.
pub trait ActuatorPart {
    /// Numbers of memory that it keeps; `step` is the model's [s].
    fn memory_len(&self, _p: &[f64], _step: f64) -> usize {
        0
    }

    /// The command that arrives, from the one that was logged. Called once a step, before it.
    fn command(&self, _p: &[f64], command: f64, _step: f64, _memory: &mut [f64]) -> f64 {
        command
    }

    /// Factor on the actuator's force, from the speed [m/s] at which it advances through the water along
    /// the thrust that it gives at present (thrust reversed: the other way).
    fn force_factor(&self, _p: &[f64], _inflow: f64) -> f64 {
        1.0
    }
}

/// A change of a sensor: measured(t) = scale * sensor(t - delay) + bias.
pub trait SensorPart {
    /// Seconds by which readings come late.
    fn delay(&self, _p: &[f64]) -> f64 {
        0.0
    }

    /// Factor on the reading.
    fn scale(&self, _p: &[f64]) -> f64 {
        1.0
    }

    /// Added to each component.
    fn bias(&self, _p: &[f64], _component: usize) -> f64 {
        0.0
    }
}

/// One effect on one target with values: what a fit gives and an `effects.json` holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Which effect.
    pub effect: Id,
    /// Name of the body, joint, actuator or sensor.
    pub target: String,
    /// Values in the order of [`Effect::parameters`].
    pub parameters: Vec<f64>,
}
