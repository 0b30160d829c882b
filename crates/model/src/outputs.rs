//! The outputs of a force model: components of the wrench on the base, and torques on joints.
//!
//! Names are `force.{x,y,z}`, `torque.{x,y,z}` and `joint_torque.<joint>`. A card and a data set list them in order; the
//! wrench is in the base frame about the base's origin, the torque of a joint is the water's generalised force on its
//! degree of freedom, as in MuJoCo's `qfrc` (N m; N of a slide).

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// Names of the components of a wrench, in order.
pub const COMPONENTS: [&str; 6] = [
    "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z",
];

/// Start of the name of a joint's torque.
const JOINT: &str = "joint_torque.";

/// Which outputs are meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Outputs {
    /// The wrench on the base.
    #[default]
    Wrench,
    /// The wrench on the base and the torque on every joint.
    Generalised,
}

impl Outputs {
    /// The kind of a list of outputs.
    pub fn of(names: &[String]) -> Self {
        let of_joint = |name: &String| matches!(name.parse(), Ok(Output::Joint(_)));
        match names.iter().any(of_joint) {
            true => Self::Generalised,
            false => Self::Wrench,
        }
    }
}

impl fmt::Display for Outputs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Wrench => "wrench",
            Self::Generalised => "generalised",
        })
    }
}

impl FromStr for Outputs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "wrench" => Ok(Self::Wrench),
            "generalised" => Ok(Self::Generalised),
            _ => Err(format!("`{text}`: expected wrench or generalised")),
        }
    }
}

/// One output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// Component 0..6 of the wrench on the base.
    Component(usize),
    /// Torque on the named joint.
    Joint(String),
}

impl fmt::Display for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Component(at) => f.write_str(COMPONENTS[*at]),
            Self::Joint(name) => write!(f, "{JOINT}{name}"),
        }
    }
}

impl FromStr for Output {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        if let Some(joint) = name.strip_prefix(JOINT).filter(|joint| !joint.is_empty()) {
            return Ok(Self::Joint(joint.to_owned()));
        }
        let at = COMPONENTS.iter().position(|known| *known == name);
        at.map(Self::Component).ok_or(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_an_output_and_an_output_its_name() {
        for name in COMPONENTS.into_iter().chain(["joint_torque.FR_hip_joint"]) {
            let output: Output = name.parse().expect("known");
            assert_eq!(output.to_string(), name);
        }
        for unknown in ["torque", "joint_torque.", "force.w", ""] {
            assert_eq!(unknown.parse::<Output>(), Err(()), "{unknown}");
        }
    }

    #[test]
    fn joints_make_a_list_generalised() {
        let names = |names: &[&str]| {
            names
                .iter()
                .map(|name| (*name).to_owned())
                .collect::<Vec<_>>()
        };
        assert_eq!(
            Outputs::of(&names(&["force.x", "torque.z"])),
            Outputs::Wrench
        );
        assert_eq!(
            Outputs::of(&names(&["force.x", "joint_torque.knee"])),
            Outputs::Generalised
        );
        for kind in [Outputs::Wrench, Outputs::Generalised] {
            assert_eq!(kind.to_string().parse(), Ok(kind));
        }
        let unknown = "joints".parse::<Outputs>();
        assert_eq!(unknown.map_err(|text| text.contains("`joints`")), Err(true));
    }
}
