//! Units, frames and the two six-vectors of rigid-body mechanics.
//!
//! Everything is SI, angles are radians. The **world** frame is MuJoCo's, z up. The **base** frame
//! is that of the body that carries the plugin (B1: `trunk`). A rotation is named for what it does:
//! `world_from_base` takes a vector expressed in the base frame to the world frame.

use std::collections::BTreeMap;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Acceleration of gravity used where a model does not say its own [m/s^2].
pub const STANDARD_GRAVITY: f64 = 9.81;

/// Force [N] and torque [N m] about the base origin, both expressed in the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force in the base frame [N].
    pub force: [f64; 3],
    /// Torque about the base origin, in the base frame [N m].
    pub torque: [f64; 3],
}

impl Wrench {
    /// From `[fx, fy, fz, tx, ty, tz]`, the order of every data file and network output.
    pub fn from_array(values: [f64; 6]) -> Self {
        let [fx, fy, fz, tx, ty, tz] = values;
        Self {
            force: [fx, fy, fz],
            torque: [tx, ty, tz],
        }
    }

    /// As `[fx, fy, fz, tx, ty, tz]`.
    pub fn to_array(self) -> [f64; 6] {
        let [fx, fy, fz] = self.force;
        let [tx, ty, tz] = self.torque;
        [fx, fy, fz, tx, ty, tz]
    }

    /// True where all six components are finite.
    pub fn is_finite(&self) -> bool {
        self.to_array().iter().all(|value| value.is_finite())
    }
}

/// Angular [rad/s] and linear [m/s] velocity of the base origin, both expressed in the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Angular velocity in the base frame [rad/s].
    pub angular: [f64; 3],
    /// Linear velocity of the base origin relative to the water, in the base frame [m/s].
    pub linear: [f64; 3],
}

/// What is wrong with `units` as the `output_units` of these force components, if anything: a `force.*` is
/// in N, a `torque.*` in N m.
pub fn output_units_fault(outputs: &[String], units: &[String]) -> Option<String> {
    if units.len() != outputs.len() {
        let (found, expected) = (units.len(), outputs.len());
        return Some(format!(
            "output_units has {found} entries, expected {expected}"
        ));
    }
    outputs.iter().zip(units).find_map(|(output, found)| {
        let expected = match output.split_once('.')?.0 {
            "force" => "N",
            "torque" => "N m",
            _ => return None,
        };
        (found != expected)
            .then(|| format!("output_units gives `{output}` in [{found}], expected [{expected}]"))
    })
}

/// What is wrong with a `frames` map, if anything: vectors that it names are expressed in the base frame,
/// written `base`, with more words after it or none.
pub fn frames_fault(frames: &BTreeMap<String, String>) -> Option<String> {
    ["wrench", "angular_velocity", "linear_velocity"]
        .into_iter()
        .find_map(|vector| {
            let found = frames.get(vector)?;
            let first = found.split([',', ' ']).next();
            (first != Some("base")).then(|| {
                format!("frames gives `{vector}` in \"{found}\", expected the frame \"base\"")
            })
        })
}

/// Rotation `world_from_base` from MuJoCo's `w x y z`. A zero quaternion is the identity, as in MuJoCo.
pub fn world_from_base(wxyz: [f64; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = wxyz;
    let quaternion = Quaternion::new(w, x, y, z);
    UnitQuaternion::try_new(quaternion, f64::MIN_POSITIVE).unwrap_or_else(UnitQuaternion::identity)
}

/// A world vector, expressed in the base frame.
pub fn base_from_world(wxyz: [f64; 4], in_world: [f64; 3]) -> [f64; 3] {
    let rotated = world_from_base(wxyz).inverse_transform_vector(&Vector3::from(in_world));
    rotated.into()
}

/// A base vector, expressed in the world frame.
pub fn to_world(wxyz: [f64; 4], in_base: [f64; 3]) -> [f64; 3] {
    let rotated = world_from_base(wxyz).transform_vector(&Vector3::from(in_base));
    rotated.into()
}

/// The sign of a quaternion that continues `previous`, or `w >= 0` where nothing came before.
///
/// `q` and `-q` are the same attitude; a network must not see the jump between them.
pub fn continuous_quaternion(wxyz: [f64; 4], previous: Option<[f64; 4]>) -> [f64; 4] {
    let agreement = match previous {
        Some(before) => wxyz.iter().zip(before).map(|(a, b)| a * b).sum(),
        None => wxyz[0],
    };
    if agreement < 0.0 {
        wxyz.map(|component| -component)
    } else {
        wxyz
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_quarter_turn_about_z_takes_base_x_to_world_y() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let in_world = to_world([half, 0.0, 0.0, half], [1.0, 0.0, 0.0]);
        for (got, want) in in_world.iter().zip([0.0, 1.0, 0.0]) {
            assert!((got - want).abs() < 1e-12, "{in_world:?}");
        }
    }

    #[test]
    fn the_sign_is_canonical_first_and_continuous_after() {
        let q = [-0.1, 0.2, 0.3, 0.4];
        let first = continuous_quaternion(q, None);
        assert!(first[0] > 0.0);
        assert_eq!(continuous_quaternion([0.1, -0.2, -0.3, -0.4], Some(q)), q);
    }

    #[test]
    fn vectors_are_in_the_base_frame_or_not_named() {
        let fault = |vector: &str, frame: &str| {
            frames_fault(&BTreeMap::from([(vector.to_owned(), frame.to_owned())]))
        };
        assert_eq!(frames_fault(&BTreeMap::new()), None);
        assert_eq!(fault("wrench", "base"), None);
        assert_eq!(
            fault("linear_velocity", "base, relative to the water"),
            None
        );
        assert_eq!(fault("quaternion", "world_from_base, w x y z"), None);
        for frame in ["world", "basement", ""] {
            let message = fault("angular_velocity", frame).expect("a fault");
            assert!(
                message.contains("`angular_velocity`") && message.contains(frame),
                "{message}"
            );
        }
    }

    proptest! {
        #[test]
        fn there_and_back(q in prop::array::uniform4(-1.0f64..1.0), v in prop::array::uniform3(-10.0f64..10.0)) {
            prop_assume!(q.iter().map(|c| c * c).sum::<f64>() > 1e-3);
            let back = base_from_world(q, to_world(q, v));
            for (a, b) in back.iter().zip(v) {
                prop_assert!((a - b).abs() < 1e-9);
            }
        }
    }
}
