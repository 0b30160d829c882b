//! The trait of an effect, and the traits of its action on bodies, water, joints, actuators and sensors.

use nalgebra::Matrix6;

use crate::{Card, Id, Medium, Motion, Parameter, Target, matrix_fault::MatrixFault};

/// Elements of a whole matrix.
pub const MATRIX_LEN: usize = 36;
/// Elements of a whole matrix and coordinates of the point that it acts at.
pub const MATRIX_AT_POINT_LEN: usize = MATRIX_LEN + 3;

/// One effect of the catalogue.
pub trait Effect: Send + Sync + std::fmt::Debug {
    /// Its entry in the catalogue.
    fn card(&self) -> &'static Card;

    /// Its parameters on a target; empty where the target is of another kind.
    fn parameters(&self, target: &Target) -> Vec<Parameter>;

    /// True where the force is proportional to every parameter, so that two of them on one target are one with the sums
    /// of their values.
    fn is_additive(&self) -> bool {
        false
    }

    /// False on a target of the right kind that cannot have the effect.
    fn applies_to(&self, _target: &Target) -> bool {
        true
    }

    /// False where `hydro gap` does not try it: it is part of a design that its user knows, not what a model forgot.
    fn is_hypothesis(&self) -> bool {
        true
    }

    /// The thinnest medium in which the effect is felt.
    fn medium(&self) -> Medium {
        Medium::None
    }

    /// True for what every body in a fluid has: a model without any fluid is expected to lack it.
    fn is_of_every_fluid(&self) -> bool {
        false
    }

    /// Effects of which a body that shows this one shows at least one too: a fluid that remembers its drag has a drag.
    fn presupposes(&self) -> &'static [Id] {
        &[]
    }

    /// The effect of a joint that does the same where this joint alone moves the body: what no data can tell apart.
    fn on_one_joint(&self) -> Option<Id> {
        None
    }

    /// True where it refines another effect, which is as good a name where the data cannot tell them apart.
    fn is_refinement(&self) -> bool {
        !self.presupposes().is_empty()
    }

    /// Terms that its law neglects for a body in the fluid, each the wrench [N, N m, body frame] of a term as large as values `p`
    /// allow, at velocity `nu` and its change `nu_dot` [m/s, rad/s and 1/s of them, body frame]. Their number depends on nothing.
    fn neglected_terms(&self, _p: &[f64], _nu: &[f64; 6], _nu_dot: &[f64; 6]) -> Vec<[f64; 6]> {
        Vec::new()
    }

    /// The surface that must be near for the effect to be felt.
    fn boundary(&self) -> Option<NearBoundary> {
        None
    }

    /// True where it is a constant, and not worth a name of its own, unless the model says how high the water stands.
    fn needs_waterline(&self) -> bool {
        false
    }

    /// True where this effect can do all that `other` does on the same body, so that no data tell one of them from both.
    /// `complete`: this effect has its optional parameters.
    fn includes(&self, _other: Id, _complete: bool) -> bool {
        false
    }

    /// True for a mass (the first parameter) at a place (the others): its weight is linear in the mass and in its first
    /// moments, mass times place.
    fn is_point_mass(&self) -> bool {
        false
    }

    /// True where its shapes are places. Places to either side of the usual are tried too, for there it may act the other way.
    fn has_places(&self) -> bool {
        self.is_point_mass()
    }

    /// True where the first parameter is a delay or lag of an actuator [s].
    fn is_timing(&self) -> bool {
        false
    }

    /// True for what every joint of a mechanism has, each in a measure of its own.
    fn is_of_every_joint(&self) -> bool {
        false
    }

    /// True where what it is proportional to may differ from trial to trial: what the water or the switched-on sensor is like on
    /// a day. Its values have no sign of their own: deviations are normal, and would make a mass negative.
    fn differs_by_trial(&self) -> bool {
        false
    }

    /// Actuators whose commands it depends on, by name: those of [`Motion::commands`].
    fn commands(&self) -> &[String] {
        &[]
    }

    /// The only targets that it is tried on, by name; any where there are none.
    fn only_on(&self) -> &[String] {
        &[]
    }

    /// Definition of an effect of the user's own: JSON that stands beside its values in an `effects.json`.
    fn definition(&self) -> Option<&str> {
        None
    }

    /// Its action.
    fn part(&self) -> Part<'_>;

    /// Its action where a whole 6 x 6 matrix stands in place of the six numbers of its diagonal.
    fn matrix_part(&self) -> Option<&dyn MatrixPart> {
        None
    }

    /// Its action on a body with these values, by their number: parameters, or a whole matrix.
    fn body_part(&self, values: &[f64]) -> Option<&dyn BodyPart> {
        match (self.matrix_part(), self.part()) {
            (Some(whole), _) if is_matrix(values) => Some(whole),
            (_, Part::Body(part)) => Some(part),
            _ => None,
        }
    }
}

/// True for as many values as a whole matrix has, with or without its point.
pub fn is_matrix(values: &[f64]) -> bool {
    [MATRIX_LEN, MATRIX_AT_POINT_LEN].contains(&values.len())
}

/// Motion of a joint at one instant: all that an effect on it may depend on.
#[derive(Clone, Debug, Default)]
pub struct JointMotion {
    /// Position [rad or m].
    pub position: f64,
    /// Velocity [rad/s or m/s].
    pub velocity: f64,
    /// Simulation time [s].
    pub time: f64,
    /// Change of the velocity in a time step under a force of 1 N or N m [rad/(s N m) or m/(s N)]; 0 in continuous time.
    pub velocity_per_force: f64,
    /// Commands of the actuators of [`Effect::commands`], in that order.
    pub commands: Vec<f64>,
}

impl JointMotion {
    /// At a position [rad or m] and velocity [rad/s or m/s], at time zero, in continuous time.
    pub fn new(position: f64, velocity: f64) -> Self {
        Self {
            position,
            velocity,
            ..Self::default()
        }
    }
}

/// A surface whose distance an effect depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NearBoundary {
    /// The surface of the water.
    FreeSurface,
    /// Walls and floor.
    Wall,
}

/// The action of an effect, by the thing acted on.
#[derive(Clone, Copy)]
#[expect(
    missing_debug_implementations,
    reason = "the effect itself, which holds the part, has one"
)]
pub enum Part<'a> {
    /// A wrench on a body.
    Body(&'a dyn BodyPart),
    /// Motion of the water: it enters the relative velocity of the nominal model's fluid and of every other effect.
    Water(&'a dyn WaterPart),
    /// A generalised force on a hinge or slide.
    Joint(&'a dyn JointPart),
    /// A change of an actuator's command or force.
    Actuator(&'a dyn ActuatorPart),
    /// A change of a sensor's reading.
    Sensor(&'a dyn SensorPart),
}

impl Part<'_> {
    /// True where it adds inertia.
    pub fn adds_inertia(&self) -> bool {
        match self {
            Self::Body(part) => part.has_inertia(),
            Self::Joint(part) => part.has_inertia(),
            Self::Water(_) | Self::Actuator(_) | Self::Sensor(_) => false,
        }
    }
}

/// A wrench on a body. `p` are the parameters in the order of [`Effect::parameters`].
pub trait BodyPart {
    /// Length of its memory, which is kept in plugin state.
    fn memory_len(&self) -> usize {
        0
    }

    /// True where it adds inertia: [`BodyPart::inertia`] may then be something.
    fn has_inertia(&self) -> bool {
        false
    }

    /// Force [N] and torque [N m] about the body's origin, in the body's frame, without the part in proportion to
    /// acceleration, which is [`BodyPart::inertia`].
    fn wrench(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> [f64; 6];

    /// Added inertia [kg, kg m, kg m^2], (linear, angular) about the body's origin in its frame: symmetric, positive
    /// semidefinite, applied implicitly.
    ///
    /// It multiplies the acceleration of the origin as seen from the world and the angular acceleration, both expressed
    /// in the body's frame. With J the Jacobian of (linear, angular) velocity in the frame's directions, that is
    /// `J qacc + (dJ/dt) qvel`, the directions held fixed in the world while differentiating; for a free body,
    /// `J qacc`. Fossen's derivative of body-frame components lacks omega x v; that part is in [`BodyPart::wrench`].
    fn inertia(&self, _p: &[f64], _motion: &Motion) -> Option<Matrix6<f64>> {
        None
    }

    /// `-d wrench / d (linear, angular velocity)`, 6 x 6, for the implicit step of stiff drag.
    fn damping(&self, _p: &[f64], _motion: &Motion, _memory: &[f64]) -> Option<Matrix6<f64>> {
        None
    }

    /// `d wrench / d p`: one column of six for each parameter.
    fn by_parameters(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Vec<[f64; 6]>;

    /// Advances the memory over a step [s] that starts at `motion`.
    fn advance(&self, _p: &[f64], _motion: &Motion, _step: f64, _memory: &mut [f64]) {}

    /// True where its memory depends on the motion and on the parameters that shape its amplitudes, not on these.
    fn remembers_motion_alone(&self) -> bool {
        false
    }
}

/// A wrench on a body by a whole 6 x 6 matrix.
///
/// `p` are its elements row by row, rows and columns in the order surge, sway, heave, roll, pitch, yaw; then, where it is
/// given, the point that it acts at, in the body's frame [m]. Without one it acts where the diagonal form does, at
/// [`Motion::middle`]: a diagonal matrix is then the same as six numbers.
pub trait MatrixPart: BodyPart {
    /// Unit of the element of a row and a column, each 0 to 5.
    fn unit(&self, row: usize, column: usize) -> &'static str;

    /// Checks that a body can have the matrix.
    ///
    /// # Errors
    /// Fault of the matrix, with the elements or the eigenvalue.
    fn check(&self, matrix: &Matrix6<f64>) -> Result<(), MatrixFault>;
}

/// Motion of the water.
pub trait WaterPart {
    /// Velocity of the water in the world [m/s] at a point [m] and a time [s].
    fn velocity(&self, p: &[f64], position: [f64; 3], time: f64) -> [f64; 3];

    /// Acceleration of the water in the world [m/s^2] at a point [m] and a time [s]. It is part of
    /// [`Motion::water_acceleration`]; its pressure acts on every wet body, [`Motion::froude_krylov`].
    fn acceleration(&self, _p: &[f64], _position: [f64; 3], _time: f64) -> [f64; 3] {
        [0.0; 3]
    }
}

/// A generalised force on a hinge [N m] or slide [N].
pub trait JointPart {
    /// Length of its memory.
    fn memory_len(&self) -> usize {
        0
    }

    /// The force in a motion.
    fn force(&self, p: &[f64], motion: &JointMotion, memory: &[f64]) -> f64;

    /// `-d force / d velocity`, for the implicit step.
    fn damping(&self, p: &[f64], motion: &JointMotion, memory: &[f64]) -> f64;

    /// True where it adds inertia ([`JointPart::inertia`]).
    fn has_inertia(&self) -> bool {
        false
    }

    /// Inertia added to the joint's [kg m^2 or kg], applied implicitly.
    fn inertia(&self, _p: &[f64]) -> f64 {
        0.0
    }

    /// Advances the memory over a step [s].
    fn advance(&self, _p: &[f64], _motion: &JointMotion, _step: f64, _memory: &mut [f64]) {}

    /// Backlash [rad or m], full width: the simulator puts a joint limited to half of it on either side in series behind
    /// this one.
    fn backlash(&self, _p: &[f64]) -> Option<f64> {
        None
    }
}

/// A change of an actuator, between the logged command and the force.
pub trait ActuatorPart {
    /// Length of its memory; `step` is the model's [s].
    fn memory_len(&self, _p: &[f64], _step: f64) -> usize {
        0
    }

    /// The command that takes effect, from the logged one. Called once before each step.
    fn command(&self, _p: &[f64], command: f64, _step: f64, _memory: &mut [f64]) -> f64 {
        command
    }

    /// The force, from the one that the actuator alone would have [N or N m].
    fn force(&self, _p: &[f64], force: f64) -> f64 {
        force
    }

    /// Factor on the actuator's force at an inflow [m/s]: its speed through the water along its present thrust.
    fn force_factor(&self, _p: &[f64], _inflow: f64) -> f64 {
        1.0
    }
}

/// A change of a sensor: measured(t) = scale * sensor(t - delay) + bias.
pub trait SensorPart {
    /// True where readings come late.
    fn has_delay(&self) -> bool {
        false
    }

    /// Delay of the readings [s].
    fn delay(&self, _p: &[f64]) -> f64 {
        0.0
    }

    /// Factor on the reading.
    fn scale(&self, _p: &[f64]) -> f64 {
        1.0
    }

    /// Offset of a component.
    fn bias(&self, _p: &[f64], _component: usize) -> f64 {
        0.0
    }
}

/// One effect on one target with values: the result of a fit, an element of an `effects.json`.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Entry {
    pub effect: Id,
    /// Name of the body, joint, actuator or sensor.
    pub target: String,
    /// Values in the order of [`Effect::parameters`]; or those of a whole matrix, as in [`MatrixPart`].
    pub parameters: Vec<f64>,
}
