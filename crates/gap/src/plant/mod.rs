//! The simulator as `hydro gap` needs it: a system that can be built with other parameters and with
//! effects added, started from any state, and stepped.

pub mod backlash;
pub mod prescribed;
pub mod wall;

use std::sync::Arc;

use hydro_effects::{Entry, Medium, card};
use hydro_frames::Wrench;
use nalgebra::DMatrix;
use thiserror::Error;

use prescribed::PrescribedMotion;
use wall::Wall;

/// Why a system could not be built or stepped.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct PlantError(pub String);

/// Which uncertainty of the nominal model a [`Nuisance`] stands for (keys of `nominal.toml`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum NuisanceClass {
    /// Masses, relative.
    Mass,
    /// Moments of inertia, relative.
    Inertia,
    /// Centre of mass [m].
    CentreOfMass,
    /// Coefficients of the nominal's fluid, relative.
    Fluid,
    /// Actuator gains, relative.
    Gain,
    /// Joint damping, relative.
    Damping,
    /// Joint stiffness, relative.
    Stiffness,
    /// When within a step commands act and forces are read, in steps.
    Timing,
    /// The part of a log's first commands that memories are led through before it.
    Start,
}

/// The number that a [`Nuisance`] changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Mass of a body, relative. Its gravity compensation is a force, and stays.
    Mass,
    /// A principal moment of inertia of a body, by axis of its inertial frame; relative.
    Inertia(usize),
    /// A coordinate of a body's centre of mass [m], by axis of the body. Gravity compensation stays where
    /// it was.
    CentreOfMass(usize),
    /// A number of `fluidcoef`, by its place in that list, of all geoms; relative.
    FluidCoefficient(usize),
    /// A number of `fluidcoef` of one geom; relative.
    GeomCoefficient(usize),
    /// Density of MuJoCo's box fluid, relative.
    Density,
    /// Viscosity of MuJoCo's box fluid, relative.
    Viscosity,
    /// Gain and bias of an actuator, relative.
    Gain,
    /// Damping of a joint, every term of it; relative.
    Damping,
    /// A term of a joint's stiffness, by its place in `stiffness`; relative.
    Stiffness(usize),
    /// Part of a step by which commands act early: a held command is late by half a step on average. Not a model parameter:
    /// the log does not say how commands were held.
    CommandLead,
    /// Change of the part of a trial's first commands that memories (lags, delays, activations) are led through before its log: zero
    /// where all of them are, -1 where actuators begin at rest. Not a model parameter: a log does not say what came before it.
    CommandsBefore,
    /// Part of the jump at the end of a step that a force read inside that step shows already. Not a model parameter: the
    /// log does not say when within a step the command changed.
    ReadingLead,
    /// Steps by which positions are read late. Not a model parameter: an integrator's positions and velocities belong to
    /// instants that differ by up to a step.
    PositionLag,
    /// The same of velocities.
    VelocityLag,
    /// The same of forces, torques and accelerations: a simulation has them before a step, a log may have them after it.
    ForceLag,
    /// A value of an effect that the nominal has in an instance of `hydro.wrench`; relative.
    EffectValue {
        /// Which of [`PlantDescription::wrench_bodies`].
        instance: usize,
        /// Which entry of its attribute `effects`.
        entry: usize,
        /// Which parameter, in the order of the catalogue.
        value: usize,
    },
    /// An axis of the wrench of the nominal's checkpoints (force x y z, torque x y z, base frame); relative.
    Wrench(usize),
}

impl Quantity {
    /// True for what a log does not say and no model holds: times within a step, and commands before the log.
    pub fn is_of_log(self) -> bool {
        matches!(self, Self::CommandLead | Self::CommandsBefore) || self.is_of_readings()
    }

    /// True for a time within a step at which something is read.
    pub fn is_of_readings(self) -> bool {
        matches!(
            self,
            Self::ReadingLead | Self::PositionLag | Self::VelocityLag | Self::ForceLag
        )
    }
}

/// Factor on a relative [`Quantity`] at a value of its [`Nuisance`]: one and the value, but no value makes a mass, a coefficient or a
/// gain negative. From half the nominal down it falls by its logarithm.
pub fn factor(value: f64) -> f64 {
    match value > -0.5 {
        true => 1.0 + value,
        false => 0.5 * (2.0 * value + 1.0).exp(),
    }
}

/// One uncertain number of the nominal model. Zero is the nominal; 0.03 is three per cent more, or, for
/// a centre of mass, 3 cm along its axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Nuisance {
    /// `hull.mass`, `hull.inertia.x`, `thruster_1.gain`.
    pub name: String,
    /// Element of the MJCF that it belongs to.
    pub element: String,
    /// Which uncertainty.
    pub class: NuisanceClass,
    /// The number that it changes.
    pub quantity: Quantity,
}

/// Inertia of a body alone, as compiled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inertial {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass in the body's frame [m].
    pub position: [f64; 3],
    /// Attitude of the principal axes in the body's frame, w x y z.
    pub attitude: [f64; 4],
    /// Principal moments [kg m^2].
    pub moments: [f64; 3],
    /// Gravity compensation, in weights of the body.
    pub compensation: f64,
}

/// A body of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantBody {
    /// Its name.
    pub name: String,
    /// True for the first body of a tree: the base.
    pub root: bool,
    /// True where at least one degree of freedom moves it.
    pub moves: bool,
    /// Index in `qvel` of the hinge or slide that alone moves it, where it is one.
    pub only_dof: Option<usize>,
    /// True for the last body of a chain: it has a degree of freedom of its own, and no body below it has.
    pub end: bool,
    /// True where it has size and weight of its own and stands in the water.
    pub wet: bool,
    /// True where the model has hydrostatics for it.
    pub floats: bool,
    /// Volume of its own hull, without what hangs on it; where no body has one, that of its mass in water [m^3].
    pub bulk: f64,
    /// Its sizes; speeds are zero until the trials are known.
    pub scale: card::BodyScale,
    /// Its own inertia.
    pub inertial: Inertial,
}

/// A hinge or slide of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantJoint {
    /// Its name.
    pub name: String,
    /// Index of its position in `qpos`.
    pub qpos: usize,
    /// Index of its velocity in `qvel`.
    pub dof: usize,
    /// Its position in the model's own first state [rad or m].
    pub start: f64,
    /// Its sizes; speeds are zero until the trials are known.
    pub scale: card::JointScale,
    /// Commands that push it in proportion: index in `ctrl` and force a unit of command [N m or N].
    pub pushes: Vec<(usize, f64)>,
    /// Its spring [N m/rad or N/m], the linear term.
    pub stiffness: f64,
    /// Its damping [N m s/rad or N s/m], the linear term.
    pub damping: f64,
    /// True for a coordinate of a body that moves freely in a plane: no bearing, no spring and no rotor is there.
    pub is_coordinate: bool,
    /// True for a slide along which depth stays as it is, in every pose.
    pub is_level: bool,
}

/// An actuator of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantActuator {
    /// Its name.
    pub name: String,
    /// Limits of its control, where it has any.
    pub range: Option<[f64; 2]>,
    /// True where it pushes at a site (a thruster): inflow matters to it.
    pub thrusts: bool,
    /// Third number of its bias: force a speed of its length, as compiled.
    pub speed_bias: f64,
}

impl SensorKind {
    /// True for a reading of positions alone.
    pub fn is_position(self) -> bool {
        matches!(
            self,
            Self::Position | Self::Quaternion | Self::JointPosition
        )
    }

    /// True for a reading of velocities alone.
    pub fn is_velocity(self) -> bool {
        matches!(
            self,
            Self::JointVelocity | Self::AngularVelocity | Self::LinearVelocity
        )
    }

    /// True for a reading of forces or accelerations.
    pub fn is_force(self) -> bool {
        matches!(self, Self::Acceleration | Self::Force | Self::Torque)
    }
}

impl PlantActuator {
    /// A command within its limits, where it has any.
    pub fn limited(&self, command: f64) -> f64 {
        self.range
            .map_or(command, |[low, high]| command.max(low).min(high))
    }
}

/// Measured quantity of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorKind {
    /// World position [m].
    Position,
    /// Attitude, w x y z.
    Quaternion,
    /// Joint position [rad or m].
    JointPosition,
    /// Joint velocity [rad/s or m/s].
    JointVelocity,
    /// Angular velocity [rad/s].
    AngularVelocity,
    /// Linear velocity [m/s].
    LinearVelocity,
    /// Linear acceleration [m/s^2].
    Acceleration,
    /// Force [N].
    Force,
    /// Torque [N m].
    Torque,
    /// Anything else.
    Other,
}

/// A sensor of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantSensor {
    /// Its name.
    pub name: String,
    /// Measured quantity.
    pub kind: SensorKind,
    /// Index of its first number in `sensordata`.
    pub start: usize,
    /// Number of its numbers.
    pub len: usize,
    /// Standard deviation of its noise, its MJCF `noise`; zero where the model says none.
    pub noise: f64,
    /// Unit of a reading.
    pub unit: &'static str,
    /// The body whose full pose or velocity it gives in that body's own frame origin, where it does: used
    /// to read a first state off the sensors.
    pub frame_of: Option<String>,
    /// The joint that it reads, where it does.
    pub joint: Option<String>,
}

/// A body that swims free, and the water it swims in: what a wrench on it depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeBase {
    /// Name of the body; empty where the model gives none.
    pub body: String,
    /// Index in `qpos` of its position x y z, followed by its attitude w x y z.
    pub qpos: usize,
    /// Index of its velocities in `qvel`: linear in the world, angular in the body's frame.
    pub dof: usize,
    /// Hinges and slides of the model that have a name, in order: a plugin knows no others.
    pub joints: Vec<String>,
    /// Density of the water as a plugin on it sees it [kg/m^3].
    pub density: f64,
    /// Velocity of the water in the world, likewise [m/s].
    pub water: [f64; 3],
    /// True where an effect of the nominal moves the water beside that.
    pub water_moves: bool,
    /// True where a learned wrench acts on it already.
    pub learned: bool,
}

/// All that `gap` knows of a system.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantDescription {
    /// Step [s].
    pub timestep: f64,
    /// Length of `qpos`.
    pub nq: usize,
    /// Length of `qvel`.
    pub nv: usize,
    /// Length of the full-physics state, as a trial's `initial_state` has it.
    pub state_len: usize,
    /// Moving bodies first to last, and those that a force or torque sensor weighs.
    pub bodies: Vec<PlantBody>,
    /// The first body with a free joint, where there is one.
    pub base: Option<FreeBase>,
    /// Hinges and slides.
    pub joints: Vec<PlantJoint>,
    /// Actuators, in the order of `ctrl`.
    pub actuators: Vec<PlantActuator>,
    /// Sensors.
    pub sensors: Vec<PlantSensor>,
    /// Uncertain numbers.
    pub nuisances: Vec<Nuisance>,
    /// Names of the bodies that carry instances of `hydro.wrench`, as [`Quantity::EffectValue`] counts them.
    pub wrench_bodies: Vec<String>,
    /// Height of the water's surface [m].
    pub waterline: f64,
    /// True where the model says how high it is.
    pub has_surface: bool,
    /// Planes and boxes of the world that stand still.
    pub walls: Vec<Wall>,
    /// The medium that the model tells of: by a fluid, by what floats in it, or none.
    pub medium: Medium,
    /// True where a fluid of this medium acts already: MuJoCo's own, a checkpoint's, or an effect of water.
    pub has_fluid: bool,
}

impl PlantDescription {
    /// Which of its numbers is [`Quantity::CommandsBefore`], where one is.
    pub fn commands_before(&self) -> Option<usize> {
        let mut numbers = self.nuisances.iter();
        numbers.position(|of| of.quantity == Quantity::CommandsBefore)
    }
}

/// A system that can be simulated under hypotheses.
pub trait Plant: Send + Sync {
    /// Bodies, joints, actuators, sensors and nuisance parameters.
    fn description(&self) -> &PlantDescription;

    /// The same system with a cheaper integrator of the same step, where there is one: good for differences
    /// of two of its own rollouts, not for comparison with a measurement.
    fn cheaper(&self) -> Option<&dyn Plant> {
        None
    }

    /// A simulation with nuisance parameters turned (`PlantDescription::nuisances` long) and effects added. Effects on
    /// sensors are not applied here: they belong to the measurement.
    ///
    /// # Errors
    /// An unknown target, a wrong number of parameters, a model that MuJoCo refuses.
    fn simulation(
        &self,
        nuisances: &[f64],
        effects: &[Entry],
    ) -> Result<Box<dyn Simulation>, PlantError>;
}

/// One simulation. Sensors keep MuJoCo's convention: after [`Simulation::step`] they show the state at
/// which that step began.
pub trait Simulation: Send {
    /// Forgets everything: initial state, cold memories, time zero.
    fn reset(&mut self);
    /// Time [s].
    fn time(&self) -> f64;
    /// Starts from a full-physics state of the nominal (time, qpos, qvel, act, plugin), with the memory of
    /// effects cold.
    fn restart(&mut self, state: &[f64]);
    /// Like [`Simulation::restart`], but the memory of effects is kept.
    fn rejoin(&mut self, state: &[f64]);
    /// Sets time, positions and velocities; memories stay.
    fn set_motion(&mut self, time: f64, qpos: &[f64], qvel: &[f64]);
    /// Positions [nq].
    fn qpos(&self) -> &[f64];
    /// Velocities [nv].
    fn qvel(&self) -> &[f64];
    /// Moves along a tangent [2 nv]: positions (rotations as rotation vectors, body frame), velocities.
    fn retract(&mut self, tangent: &[f64]);
    /// The tangent [nv] that leads from a position to another.
    fn differentiate(&self, from: &[f64], to: &[f64], tangent: &mut [f64]);
    /// Brings all memory over the step from the present state, at the control that is set, to a full-physics state after it.
    fn remember(&mut self, next: &[f64]) {
        self.step();
        self.rejoin(next);
    }

    /// Full-physics state of the nominal, as [`Simulation::rejoin`] takes it: time, positions, velocities, and after them what else it
    /// remembers (activations, histories, plugins).
    fn full_state(&self) -> Vec<f64>;
    /// Part of a trial's first commands that memories are led through before its log ([`Quantity::CommandsBefore`]).
    fn commands_before(&self) -> f64 {
        1.0
    }
    /// Memory of the effects.
    fn memory(&self) -> Vec<f64>;
    /// Numbers at the end of [`Simulation::memory`] that are states of joints which the nominal does not have.
    fn hidden(&self) -> usize {
        0
    }
    /// Sets it; that of a simulation of the same effects, but for ones without memory.
    fn set_memory(&mut self, memory: &[f64]);
    /// Everything, memories too.
    fn save(&self) -> Vec<f64>;
    /// Goes back to what [`Simulation::save`] of a simulation of the same effects gave.
    fn load(&mut self, saved: &[f64]);
    /// Velocity of a body's origin and its rate, in the body's own frame, by degree of freedom [6, nv] [m/s, rad/s]; zero of what
    /// is no body.
    fn body_jacobian(&mut self, body: &str) -> DMatrix<f64>;
    /// The command as logged, for the next step.
    fn set_control(&mut self, control: &[f64]);
    /// A wrench on [`PlantDescription::base`] beyond the model's own, held until it is set again, whatever
    /// the state is set to in between. Without a free joint nothing happens.
    fn set_base_wrench(&mut self, wrench: Wrench);
    /// The command of the step before, which an early command ([`Quantity::CommandLead`]) is extrapolated from.
    fn set_earlier_control(&mut self, control: &[f64]);
    /// Generalised forces [nv] beyond the model's own, held until set again; a base wrench is added to them.
    fn set_force(&mut self, force: &[f64]);
    /// Imposes the motion of joints from here on, or of none. Before and after every step their positions and velocities are
    /// those of the motion; the generalised force that gives them its acceleration is applied, and shows in force sensors
    /// as the force between a carriage and what it carries. Of [`Simulation::set_force`] the parts along them move
    /// nothing: they act on the heaviest body that the joint carries, where force sensors feel them.
    fn prescribe(&mut self, motion: Option<Arc<PrescribedMotion>>);
    /// One step.
    fn step(&mut self);
    /// Makes [`Simulation::sensors`] show the present state under the command of the last step.
    fn look(&mut self);
    /// [`Quantity::ReadingLead`] of this simulation.
    fn reading_lead(&self) -> f64;
    /// Readings at the beginning of the last step; force and torque sensors show what was added.
    fn sensors(&self) -> &[f64];
    /// True where the simulation has blown up since it was last started.
    fn diverged(&self) -> bool;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_value_makes_a_positive_number_negative() {
        assert_eq!([-0.15, 0.0, 0.03].map(factor), [0.85, 1.0, 1.03]);
        let mut last = factor(-0.4);
        for value in [-0.5, -0.5 - 1e-9, -0.6, -1.0, -1.5, -5.0, -50.0] {
            let here = factor(value);
            assert!(0.0 < here && here < last, "{value}: {here}");
            last = here;
        }
        // Value and slope go on where the logarithm begins.
        let slope = |at: f64| (factor(at + 1e-6) - factor(at)) / 1e-6;
        assert!((slope(-0.5 - 2e-6) - slope(-0.5 + 1e-6)).abs() < 1e-5);
    }

    #[test]
    fn a_command_counts_as_far_as_its_limits_let_it() {
        let mut thruster = PlantActuator {
            name: "bow".to_owned(),
            range: Some([-0.5, 1.0]),
            thrusts: true,
            speed_bias: 0.0,
        };
        let limited = |of: &PlantActuator| [-2.0, 0.3, 2.0].map(|command| of.limited(command));
        assert_eq!(limited(&thruster), [-0.5, 0.3, 1.0]);
        thruster.range = None;
        assert_eq!(limited(&thruster), [-2.0, 0.3, 2.0]);
    }
}
