//! Signature of a model: its actuators and sensors, and the columns of a trial that belong to them.

use std::path::Path;

use super::{
    TrialError,
    message::{distance, listed},
    series::component_name,
};

/// Suffix that `mujoco.sysid` appends to an actuator's name.
pub(super) const CONTROL_SUFFIX: &str = "_ctrl";

/// Suffix of a prescribed joint's column, for a joint that shares its name with an actuator or a sensor.
const POSITION_SUFFIX: &str = "_pos";

/// Kind of a sensor's numbers, where units can be checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorQuantity {
    /// A unit quaternion, w x y z.
    Quaternion,
    /// An angle [rad].
    Angle,
    /// Anything else, in SI units.
    Other,
}

/// A sensor of the model.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct SensorSignature {
    /// Its name in the MJCF.
    pub name: String,
    /// Length of its reading.
    pub dim: usize,
    pub kind: SensorQuantity,
}

/// Actuators, sensors and sizes of a model. The caller fills it from the MJCF, so that reading trials needs no MuJoCo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signature {
    /// Names of the actuators, in the model's order, `[nu]`.
    pub actuators: Vec<String>,
    /// The sensors, in the model's order.
    pub sensors: Vec<SensorSignature>,
    /// Names of the hinges and slides, which a trial may prescribe.
    pub joints: Vec<String>,
    /// Length of the full-physics state: time, qpos, qvel, and the rest.
    pub state_len: usize,
    /// Step of the model [s].
    pub timestep: f64,
}

impl SensorSignature {
    /// Names of this sensor's columns: its name for a scalar, `name[i]` for a vector.
    pub fn columns(&self) -> Vec<String> {
        if self.dim == 1 {
            return vec![self.name.clone()];
        }
        (0..self.dim)
            .map(|component| component_name(&self.name, component))
            .collect()
    }
}

impl Signature {
    /// Names of all sensor columns in the model's order, `[nsensordata]`.
    pub fn sensor_columns(&self) -> Vec<String> {
        self.sensors
            .iter()
            .flat_map(SensorSignature::columns)
            .collect()
    }

    /// Index of the actuator of a column, which is its name with or without `_ctrl`.
    pub(super) fn actuator(&self, column: &str) -> Option<usize> {
        let find = |name: &str| self.actuators.iter().position(|actuator| actuator == name);
        find(column).or_else(|| find(column.strip_suffix(CONTROL_SUFFIX)?))
    }

    /// Index of the joint of a column of positions, which is its name with or without `_pos`.
    pub(super) fn joint(&self, column: &str) -> Option<usize> {
        let find = |name: &str| self.joints.iter().position(|joint| joint == name);
        find(column).or_else(|| find(column.strip_suffix(POSITION_SUFFIX)?))
    }

    /// Actuators, sensors and joints of the model, in words for an error.
    pub(super) fn describe(&self) -> String {
        let sensors: Vec<String> = self
            .sensors
            .iter()
            .map(|sensor| match sensor.dim {
                1 => sensor.name.clone(),
                dim => format!("{}[0..{dim}]", sensor.name),
            })
            .collect();
        format!(
            "the model has the actuators {}, the sensors {} and the joints {}",
            listed(&self.actuators),
            listed(&sensors),
            listed(&self.joints)
        )
    }

    /// The error for a column or signal that the model does not have.
    pub(super) fn unknown(&self, path: &Path, column: &str) -> TrialError {
        let signal = column.split('[').next().unwrap_or(column);
        let sensors = self.sensors.iter().map(|sensor| &sensor.name);
        let nearest = self
            .actuators
            .iter()
            .chain(sensors)
            .chain(&self.joints)
            .map(|name| (distance(signal, name), name))
            .min()
            // Half of the letters may be wrong; beyond that the two have nothing in common.
            .filter(|(distance, name)| 2 * distance <= name.chars().count().max(2));
        TrialError::UnknownColumn {
            path: path.to_owned(),
            column: column.to_owned(),
            nearest: nearest.map(|(_, name)| name.clone()),
            model: self.describe(),
        }
    }
}
