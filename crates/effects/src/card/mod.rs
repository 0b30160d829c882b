//! An effect's card: its name, target, equation and source, its parameters, and the sizes that their priors depend on.

mod body_scale;
mod id;
mod joint_scale;
mod medium;
mod own_id;
mod parameter;
mod physical;
mod target;

use serde::{Deserialize, Serialize};

pub use body_scale::BodyScale;
pub use id::Id;
pub use joint_scale::JointScale;
pub use medium::Medium;
pub(crate) use own_id::MOST_OWN;
pub use own_id::{OWN_PREFIX, OwnId};
pub use parameter::Parameter;
pub use physical::{LARGEST, Physical};
pub use target::{ActuatorScale, SensorScale, Target};

/// Kind of thing that an effect acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum TargetKind {
    Body,
    /// A hinge or slide.
    Joint,
    Actuator,
    Sensor,
}

/// Place of an effect in a patched model.
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
#[allow(missing_docs)]
pub struct Card {
    pub id: Id,
    /// The effect in a sentence, after "the model lacks".
    pub phrase: &'static str,
    pub target: TargetKind,
    /// One line for a person.
    pub summary: &'static str,
    /// The equation, in plain text.
    pub equation: &'static str,
    /// The publication that the equation is from.
    pub source: &'static str,
    /// True where the equation idealises water, joints or actuators, so that the true form differs a little; false where
    /// the coefficients are the effect itself: a mass, a force, a velocity, a gain, a width, an offset.
    pub idealised: bool,
    pub placement: Placement,
}
