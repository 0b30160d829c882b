//! Names of the effects.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::own_id::OwnId;

macro_rules! ids {
    ($($(#[$doc:meta])* $variant:ident = $name:literal;)*) => {
        /// Name of an effect; files spell it as [`Id::as_str`], for good.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Id {
            $($(#[$doc])* $variant,)*
            /// One of the user's own.
            Own(OwnId),
        }

        impl Id {
            /// Every effect that is built in, in the order of the catalogue.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// The spelling in files.
            pub fn as_str(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                    Self::Own(own) => own.as_str(),
                }
            }

            /// The effect of a spelling: built in, or the user's own of that name that this process was told of last.
            pub fn from_name(name: &str) -> Option<Self> {
                let built_in = Self::ALL.iter().copied().find(|id| id.as_str() == name);
                built_in.or_else(|| OwnId::latest(name).map(Self::Own))
            }
        }
    };
}

ids! {
    /// Water that accelerates with the body.
    AddedMass = "added_mass";
    /// Drag in proportion to velocity.
    LinearDrag = "linear_drag";
    /// Drag in proportion to velocity squared.
    QuadraticDrag = "quadratic_drag";
    /// Drag of strips along the body.
    CrossFlowDrag = "cross_flow_drag";
    /// Constant velocity of the water.
    Current = "current";
    /// Munk's moment of a body at an angle of attack.
    MunkMoment = "munk_moment";
    /// Force across the flow.
    Lift = "lift";
    /// Foil with stall.
    Fin = "fin";
    /// Propeller on its shaft.
    Propeller = "propeller";
    /// Wind on what is out of the water.
    Windage = "windage";
    /// Buoyancy less weight.
    NetBuoyancy = "net_buoyancy";
    /// Centre of buoyancy away from the model's.
    BuoyancyOffset = "buoyancy_offset";
    /// Point mass.
    Payload = "payload";
    /// Drag that lags behind the motion.
    WakeMemory = "wake_memory";
    /// Basset's history force.
    BassetHistory = "basset_history";
    /// Buoyancy of the submerged part of the hull.
    Hydrostatics = "hydrostatics";
    /// Drag and added mass near the surface.
    FreeSurface = "free_surface";
    /// Drag and added mass near a wall.
    WallProximity = "wall_proximity";
    /// Regular wave.
    Waves = "waves";
    /// Factor on an actuator's force.
    ActuatorGain = "actuator_gain";
    /// Dead band of an actuator.
    ActuatorDeadband = "actuator_deadband";
    /// First-order lag of an actuator.
    ActuatorLag = "actuator_lag";
    /// Pure delay of an actuator.
    ActuatorDelay = "actuator_delay";
    /// Thrust by command.
    ThrustCurve = "thrust_curve";
    /// Thrust loss with inflow.
    InflowThrustLoss = "inflow_thrust_loss";
    /// Coulomb and Stribeck friction of a joint.
    JointFriction = "joint_friction";
    /// Viscous damping of a joint.
    JointDamping = "joint_damping";
    /// Rotor inertia of a joint.
    JointArmature = "joint_armature";
    /// Spring of a joint.
    JointStiffness = "joint_stiffness";
    /// Backlash of a joint.
    JointBacklash = "joint_backlash";
    /// Constant added to a reading.
    SensorBias = "sensor_bias";
    /// Delay of a reading.
    SensorDelay = "sensor_delay";
    /// Factor on a reading.
    SensorScale = "sensor_scale";
    /// Constant force in the world.
    ConstantForce = "constant_force";
}

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

impl Serialize for Id {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for Id {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::from_name(&name)
            .ok_or_else(|| de::Error::custom(format!("there is no effect `{name}`")))
    }
}

impl Id {
    /// Drags of a body, one of which goes with an added mass, a memory or a lift.
    pub(crate) const DRAGS: &'static [Self] =
        &[Self::LinearDrag, Self::QuadraticDrag, Self::CrossFlowDrag];
}
