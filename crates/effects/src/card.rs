//! What an effect is: its name, its target, its equation, its parameters and their priors.

use serde::{Deserialize, Serialize};

macro_rules! ids {
    ($($(#[$doc:meta])* $variant:ident = $name:literal;)*) => {
        /// The name of an effect. The names are a contract.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Id {
            $($(#[$doc])* $variant,)*
        }

        impl Id {
            /// All, in the order of the catalogue.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// As written in every file.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $name),* }
            }
        }
    };
}

ids! {
    /// Fluid that is accelerated with the body.
    AddedMass = "added_mass";
    /// Drag in proportion to velocity.
    LinearDrag = "linear_drag";
    /// Drag in proportion to velocity squared.
    QuadraticDrag = "quadratic_drag";
    /// Drag of strips along the body.
    CrossFlowDrag = "cross_flow_drag";
    /// Constant velocity of the water.
    Current = "current";
    /// Turning moment of a body at an angle of attack.
    MunkMoment = "munk_moment";
    /// Force across the flow.
    Lift = "lift";
    /// Buoyancy less weight, at the centre.
    NetBuoyancy = "net_buoyancy";
    /// Buoyancy away from the centre.
    BuoyancyOffset = "buoyancy_offset";
    /// A point mass carried along.
    Payload = "payload";
    /// Fluid memory of past motion.
    WakeMemory = "wake_memory";
    /// Viscous memory of past acceleration.
    BassetHistory = "basset_history";
    /// Coefficients that change near the surface.
    FreeSurface = "free_surface";
    /// Coefficients that change near a wall.
    WallProximity = "wall_proximity";
    /// Oscillating water.
    Waves = "waves";
    /// An actuator stronger or weaker than said.
    ActuatorGain = "actuator_gain";
    /// Small commands that do nothing.
    ActuatorDeadband = "actuator_deadband";
    /// First-order lag of an actuator.
    ActuatorLag = "actuator_lag";
    /// Pure delay of an actuator.
    ActuatorDelay = "actuator_delay";
    /// Thrust that falls with inflow speed.
    InflowThrustLoss = "inflow_thrust_loss";
    /// Coulomb and Stribeck friction of a joint.
    JointFriction = "joint_friction";
    /// Viscous damping of a joint.
    JointDamping = "joint_damping";
    /// Spring of a joint.
    JointStiffness = "joint_stiffness";
    /// Play of a joint.
    JointBacklash = "joint_backlash";
    /// A reading off by a constant.
    SensorBias = "sensor_bias";
    /// A reading that comes late.
    SensorDelay = "sensor_delay";
    /// A reading off by a factor.
    SensorScale = "sensor_scale";
    /// A constant force in the world.
    ConstantForce = "constant_force";
}

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// What an effect acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TargetKind {
    /// A body.
    Body,
    /// A hinge or slide.
    Joint,
    /// An actuator.
    Actuator,
    /// A sensor.
    Sensor,
}

/// Where an effect is written in a patched model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// The attribute `effects` of `hydro.wrench`.
    Plugin,
    /// Plain MJCF.
    Mjcf,
    /// `patch.sensors` of `verdict.json`.
    Sensors,
}

/// An effect's entry in the catalogue.
#[derive(Debug)]
pub struct Card {
    /// Its name.
    pub id: Id,
    /// What it acts on.
    pub target: TargetKind,
    /// One line for a person.
    pub summary: &'static str,
    /// The equation, in plain text.
    pub equation: &'static str,
    /// Where the equation is from.
    pub source: &'static str,
    /// True where the equation idealises what water, joints and actuators do, so that its coefficients stand for what is
    /// a little different; false where they say what the effect is: a mass, a force, a velocity, a gain, a width, an offset.
    pub idealised: bool,
    /// Where it is written.
    pub placement: Placement,
}

/// One parameter of an effect on a target.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name; a contract.
    pub name: String,
    /// Its unit; a contract. `1` where it has none.
    pub unit: &'static str,
    /// The value that means "no effect".
    pub null: f64,
    /// Standard deviation of the normal prior about [`Parameter::null`], before the bounds.
    pub prior_sd: f64,
    /// Least value with a meaning.
    pub lower: f64,
    /// Greatest value with a meaning.
    pub upper: f64,
    /// A value at which a first fit may start where the null is a point without derivatives (a delay, a
    /// frequency); elsewhere the null.
    pub start: f64,
    /// True where the effect also stands without it, at its null: a file may leave it out.
    pub optional: bool,
    /// True where it shapes what the effect's amplitudes do (a frequency, a length, a place): it says nothing while they
    /// are zero.
    pub shapes: bool,
}

/// What a prior may depend on: the sizes of the thing acted on.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// A body, with all that hangs on it where it is the root of a tree.
    Body(BodyScale),
    /// A joint.
    Joint(JointScale),
    /// An actuator.
    Actuator(ActuatorScale),
    /// A sensor.
    Sensor(SensorScale),
}

/// Sizes of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyScale {
    /// Mass [kg]; of the whole tree where the body is its root.
    pub mass: f64,
    /// Moments of inertia about the body's origin, along its axes [kg m^2].
    pub inertia: [f64; 3],
    /// Extents along the body's axes [m].
    pub extent: [f64; 3],
    /// Displaced volume [m^3].
    pub volume: f64,
    /// Density of the water [kg/m^3].
    pub density: f64,
    /// Gravity [m/s^2].
    pub gravity: f64,
    /// Typical speed in the trials [m/s].
    pub speed: f64,
    /// Typical angular rate in the trials [rad/s].
    pub rate: f64,
}

/// Sizes of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointScale {
    /// Inertia that the joint moves [kg m^2 or kg].
    pub inertia: f64,
    /// Largest torque that gravity or the actuator puts on it [N m or N].
    pub torque: f64,
    /// Typical speed in the trials [rad/s or m/s].
    pub speed: f64,
    /// Typical excursion in the trials [rad or m].
    pub travel: f64,
    /// True for a slide.
    pub slides: bool,
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
}
