//! The inputs of a force model: an ordered list of features.
//!
//! The list is data, read from a data set's `manifest.json` or a checkpoint's `card.json`; no code assumes the 35
//! features of the B1 robot. Names are `position.<joint>`, `velocity.<joint>`,
//! `quaternion.{w,x,y,z}`, `angular_velocity.{x,y,z}`, `linear_velocity.{x,y,z}`, `density`.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Component names of a vector feature.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Component names of the quaternion `world_from_base`.
const QUATERNION: [&str; 4] = ["w", "x", "y", "z"];

/// Names of features, for a message.
const NAMES: &str = "position.<joint>, velocity.<joint>, quaternion.{w,x,y,z}, angular_velocity.{x,y,z}, \
                     linear_velocity.{x,y,z} or density";

/// One input of a force model.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Feature {
    /// Position of the named joint [rad, or m for a slide].
    JointPosition(String),
    /// Velocity of the named joint [rad/s, or m/s].
    JointVelocity(String),
    /// Component 0..4 (w x y z) of `world_from_base`.
    Quaternion(usize),
    /// Component 0..3 of the base's angular velocity, in the base frame [rad/s].
    AngularVelocity(usize),
    /// Component 0..3 of the velocity of the base origin relative to the water, in the base frame [m/s].
    LinearVelocity(usize),
    /// Density of the water [kg/m^3].
    Density,
}

impl Feature {
    /// The unit, as written in manifests and cards.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::JointPosition(_) => "rad",
            Self::JointVelocity(_) | Self::AngularVelocity(_) => "rad/s",
            Self::Quaternion(_) => "1",
            Self::LinearVelocity(_) => "m/s",
            Self::Density => "kg/m^3",
        }
    }

    /// True for [`Self::unit`], and for the unit of a slide joint (m, m/s) where the feature belongs to a joint.
    fn has_unit(&self, unit: &str) -> bool {
        let slide = match self {
            Self::JointPosition(_) => Some("m"),
            Self::JointVelocity(_) => Some("m/s"),
            _ => None,
        };
        unit == self.unit() || slide == Some(unit)
    }

    /// True if only a free joint provides it.
    pub fn needs_free_joint(&self) -> bool {
        matches!(
            self,
            Self::Quaternion(_) | Self::AngularVelocity(_) | Self::LinearVelocity(_)
        )
    }
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointPosition(joint) => write!(f, "position.{joint}"),
            Self::JointVelocity(joint) => write!(f, "velocity.{joint}"),
            Self::Quaternion(i) => write!(f, "quaternion.{}", QUATERNION[*i]),
            Self::AngularVelocity(i) => write!(f, "angular_velocity.{}", AXES[*i]),
            Self::LinearVelocity(i) => write!(f, "linear_velocity.{}", AXES[*i]),
            Self::Density => write!(f, "density"),
        }
    }
}

/// Reason for refusing a feature list.
#[derive(Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum FeatureError {
    /// A name that is none of those in the module's list.
    #[error("unknown feature `{0}`: expected {NAMES}")]
    Unknown(String),
    /// The same feature twice.
    #[error("feature `{0}` is in the list twice")]
    Duplicate(String),
    /// An incomplete quaternion, or one whose components are out of order.
    #[error(
        "the quaternion must be four neighbouring features in the order w x y z, or absent altogether"
    )]
    BrokenQuaternion,
    /// An empty list.
    #[error("the feature list is empty; expected at least one of {NAMES}")]
    Empty,
}

impl FromStr for Feature {
    type Err = FeatureError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let unknown = || FeatureError::Unknown(name.to_owned());
        let component =
            |names: &[&str], found: &str| names.iter().position(|known| *known == found);
        let (kind, rest) = match name.split_once('.') {
            Some(parts) => parts,
            None if name == "density" => return Ok(Self::Density),
            None => return Err(unknown()),
        };
        match kind {
            "position" if !rest.is_empty() => Ok(Self::JointPosition(rest.to_owned())),
            "velocity" if !rest.is_empty() => Ok(Self::JointVelocity(rest.to_owned())),
            "quaternion" => component(&QUATERNION, rest)
                .map(Self::Quaternion)
                .ok_or_else(unknown),
            "angular_velocity" => component(&AXES, rest)
                .map(Self::AngularVelocity)
                .ok_or_else(unknown),
            "linear_velocity" => component(&AXES, rest)
                .map(Self::LinearVelocity)
                .ok_or_else(unknown),
            _ => Err(unknown()),
        }
    }
}

impl TryFrom<String> for Feature {
    type Error = FeatureError;

    fn try_from(name: String) -> Result<Self, Self::Error> {
        name.parse()
    }
}

impl From<Feature> for String {
    fn from(feature: Feature) -> Self {
        feature.to_string()
    }
}

/// An ordered, checked feature list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Feature>", into = "Vec<Feature>")]
pub struct FeatureLayout(Vec<Feature>);

impl FeatureLayout {
    /// Checks that no feature is listed twice and that a quaternion, if any, is complete and in order.
    pub fn new(features: Vec<Feature>) -> Result<Self, FeatureError> {
        if features.is_empty() {
            return Err(FeatureError::Empty);
        }
        let mut seen = std::collections::HashSet::new();
        for feature in &features {
            if !seen.insert(feature) {
                return Err(FeatureError::Duplicate(feature.to_string()));
            }
        }
        let at: Vec<(usize, usize)> = features
            .iter()
            .enumerate()
            .filter_map(|(index, feature)| match feature {
                Feature::Quaternion(component) => Some((index, *component)),
                _ => None,
            })
            .collect();
        let whole = at.len() == 4
            && at
                .iter()
                .enumerate()
                .all(|(i, (index, component))| *component == i && *index == at[0].0 + i);
        if !at.is_empty() && !whole {
            return Err(FeatureError::BrokenQuaternion);
        }
        Ok(Self(features))
    }

    /// The layout of a floating-base robot: joint positions, joint velocities, quaternion, angular
    /// velocity, linear velocity, density (the B1 robot: 12 + 12 + 4 + 3 + 3 + 1 = 35).
    pub fn floating_base(joints: &[String]) -> Result<Self, FeatureError> {
        let positions = joints.iter().cloned().map(Feature::JointPosition);
        let velocities = joints.iter().cloned().map(Feature::JointVelocity);
        let base = (0..4)
            .map(Feature::Quaternion)
            .chain((0..3).map(Feature::AngularVelocity))
            .chain((0..3).map(Feature::LinearVelocity))
            .chain([Feature::Density]);
        Self::new(positions.chain(velocities).chain(base).collect())
    }

    /// The features, in order.
    pub fn features(&self) -> &[Feature] {
        &self.0
    }

    /// Numbers in a sample.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Reason why `units` is not the `feature_units` list of this layout, if there is one.
    pub fn units_fault(&self, units: &[String]) -> Option<String> {
        if units.len() != self.len() {
            let (found, expected) = (units.len(), self.len());
            return Some(format!(
                "feature_units has {found} entries, expected {expected}"
            ));
        }
        let mut pairs = self.0.iter().zip(units);
        let (feature, found) = pairs.find(|(feature, unit)| !feature.has_unit(unit))?;
        Some(format!(
            "feature_units gives `{feature}` in [{found}], expected [{}]",
            feature.unit()
        ))
    }

    /// Never true: an empty list is refused on construction.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Index of a feature.
    pub fn index_of(&self, feature: &Feature) -> Option<usize> {
        self.0.iter().position(|known| known == feature)
    }

    /// Index of the quaternion's `w`; x, y, z follow.
    pub fn quaternion(&self) -> Option<usize> {
        self.index_of(&Feature::Quaternion(0))
    }

    /// Index of the density.
    pub fn density(&self) -> Option<usize> {
        self.index_of(&Feature::Density)
    }

    /// Joint names in order of first appearance.
    pub fn joints(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for feature in &self.0 {
            if let Feature::JointPosition(joint) | Feature::JointVelocity(joint) = feature
                && !names.contains(joint)
            {
                names.push(joint.clone());
            }
        }
        names
    }
}

impl TryFrom<Vec<Feature>> for FeatureLayout {
    type Error = FeatureError;

    fn try_from(features: Vec<Feature>) -> Result<Self, Self::Error> {
        Self::new(features)
    }
}

impl From<FeatureLayout> for Vec<Feature> {
    fn from(layout: FeatureLayout) -> Self {
        layout.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn b1_joints() -> Vec<String> {
        let legs = ["FR", "FL", "RR", "RL"];
        let parts = ["hip", "thigh", "calf"];
        legs.iter()
            .flat_map(|leg| parts.map(|part| format!("{leg}_{part}_joint")))
            .collect()
    }

    #[test]
    fn b1_has_the_thirty_five_numbers_of_the_contract() {
        let layout = FeatureLayout::floating_base(&b1_joints()).expect("valid");
        assert_eq!(layout.len(), 35);
        assert_eq!(layout.quaternion(), Some(24));
        assert_eq!(layout.density(), Some(34));
        assert_eq!(layout.joints(), b1_joints());
    }

    #[test]
    fn a_layout_survives_json() {
        let layout = FeatureLayout::floating_base(&b1_joints()).expect("valid");
        let text = serde_json::to_string(&layout).expect("serialises");
        assert!(text.starts_with("[\"position.FR_hip_joint\""));
        assert_eq!(
            serde_json::from_str::<FeatureLayout>(&text).expect("parses"),
            layout
        );
    }

    #[test]
    fn units_are_those_of_the_features() {
        let layout = FeatureLayout::new(vec![Feature::JointPosition("a".into()), Feature::Density])
            .expect("valid");
        let fault = |units: &[&str]| {
            let units: Vec<String> = units.iter().map(|unit| (*unit).to_owned()).collect();
            layout.units_fault(&units)
        };
        assert_eq!(fault(&["rad", "kg/m^3"]), None);
        assert_eq!(fault(&["m", "kg/m^3"]), None, "the joint may be a slide");
        for (units, expected) in [
            (["deg", "kg/m^3"], "`position.a` in [deg], expected [rad]"),
            (["rad", "m"], "`density` in [m], expected [kg/m^3]"),
        ] {
            let message = fault(&units).expect("a fault");
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn refusals_name_what_was_found() {
        assert!(
            matches!("speed".parse::<Feature>(), Err(FeatureError::Unknown(name)) if name == "speed")
        );
        assert!("quaternion.q".parse::<Feature>().is_err());
        assert!("position.".parse::<Feature>().is_err());
        let twice = vec![Feature::Density, Feature::Density];
        assert_eq!(
            FeatureLayout::new(twice),
            Err(FeatureError::Duplicate("density".into()))
        );
        let broken = vec![Feature::Quaternion(0), Feature::Quaternion(2)];
        assert_eq!(
            FeatureLayout::new(broken),
            Err(FeatureError::BrokenQuaternion)
        );
        assert_eq!(FeatureLayout::new(vec![]), Err(FeatureError::Empty));
        for error in [FeatureError::Empty, FeatureError::Unknown("speed".into())] {
            let text = error.to_string();
            assert!(
                text.contains("linear_velocity.{x,y,z} or density"),
                "{text}"
            );
        }
    }

    proptest! {
        #[test]
        fn any_text_parses_or_is_refused_by_name(text in ".{0,40}") {
            match text.parse::<Feature>() {
                Ok(feature) => prop_assert_eq!(feature.to_string(), text),
                Err(error) => prop_assert!(error.to_string().contains(&text)),
            }
        }
    }
}
