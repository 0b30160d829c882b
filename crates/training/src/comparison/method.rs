//! A method under comparison: a simulator, and the water that drives it.

use hydro_frames::{Twist, Wrench};

use crate::{rollouts::Rollout, simulator::Simulator};

/// Name of the method with the true base wrench at its own state: nobody who gives a base wrench can do better.
pub const ORACLE: &str = "oracle, at its own state";

/// Names of the methods that are given the recorded force of every physics step: on the base alone, and on the joints too.
pub const ORACLE_OF_THE_BASE: &str = "oracle of the base, every step replayed";
/// See [`ORACLE_OF_THE_BASE`].
pub const ORACLE_OF_ALL: &str = "oracle of all joints, every step replayed";

/// One row of the comparison.
pub struct Method<'a, E> {
    /// Name in the table.
    pub name: String,
    /// Builds its simulator.
    pub simulator: Box<MakeSimulator<'a, E>>,
    /// Its water.
    pub water: Water<'a>,
}

impl<E> std::fmt::Debug for Method<'_, E> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Method")
            .field("name", &self.name)
            .field("water", &self.water)
            .finish_non_exhaustive()
    }
}

/// Source of a method's base wrench.
pub enum Water<'a> {
    /// The scene's own: a plugin, or MuJoCo's fluid.
    Scene,
    /// A law of the base twist, evaluated every step.
    Law(Box<WrenchFunction<'a>>),
    /// The true base wrench at the method's own state, evaluated every step; built for a run's density.
    Truth(Box<MakeTruth<'a>>),
    /// The recorded true wrench, interpolated between samples. Nothing feeds back: once the motion differs,
    /// the wrench is that of another motion.
    Replayed,
    /// The recorded generalised force of every physics step, on all degrees of freedom or on the base's six alone. Where the
    /// model is the truth's and all are given, the motion is the truth's.
    Steps {
        /// True for all degrees of freedom.
        joints: bool,
    },
}

impl std::fmt::Debug for Water<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Scene => "Scene",
            Self::Law(_) => "Law",
            Self::Truth(_) => "Truth",
            Self::Replayed => "Replayed",
            Self::Steps { joints: true } => "Steps of all degrees of freedom",
            Self::Steps { joints: false } => "Steps of the base",
        })
    }
}

/// A wrench as a function of the base twist and the water's density [kg/m^3].
pub type WrenchFunction<'a> = dyn Fn(&Twist, f64) -> Wrench + 'a;

/// The wrench that another simulator's water puts on the base at a state: positions, velocities.
pub type WrenchAtState = dyn FnMut(&[f64], &[f64]) -> Wrench;

/// Builds the truth for a run (its density is part of the scene).
pub type MakeTruth<'a> = dyn Fn(&Rollout) -> Box<WrenchAtState> + 'a;

/// Builds the simulator for a run (its density is part of the scene).
pub type MakeSimulator<'a, E> = dyn Fn(&Rollout) -> Result<Box<dyn Simulator>, E> + 'a;
