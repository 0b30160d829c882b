//! One recorded run ("trial"), measured or simulated: controls, sensors, and states where they are known.
//!
//! # Files
//! `.npz` is what `mujoco.sysid`'s `SystemTrajectory.save_to_disk` writes, without pickles. `.csv` has a column
//! `time` [s], one column for each actuator and sensor under its name in the model (`imu_gyro[0]` and so on for
//! a vector), and, where they are known, the states as `qpos[i]`, `qvel[i]`, `act[i]` or as the whole
//! full-physics vector `state[i]`. A cell is empty where a signal has no sample in that row, so signals of
//! different rates share one file; `nan` in a sensor's cell is a sample that was lost. Where an actuator and a
//! sensor share a name, the actuator's column is `name_ctrl`.
//!
//! # Time
//! The convention is that of `mujoco.sysid`'s `sysid_rollout`. `mj_step` reads sensors at the start of a step
//! and the row is labelled with the time at its end, so **a sensor row labelled t holds the sensors of the state
//! at t - timestep**; a state row labelled t is the state at t. Controls are linear between rows, held before
//! the first and after the last, and held over a model step. `initial_state` is the state from which the run
//! starts, at the time that is its first number.
//!
//! # What is kept
//! Rows, their times and their rates stay as they were recorded; [`Series::resample`] is there for who wants
//! another grid. Columns are put into the model's order. A sensor that the log lacks has no column. What a
//! person should know is said in a [`Remark`]; what cannot be replayed or compared is refused by a
//! [`TrialError`].

mod arrays;
mod assemble;
mod columns;
mod csv;
mod error;
mod folder;
mod npz;
mod remark;
mod series;
mod split;
mod times;
mod units;
mod write;

use std::{ffi::OsStr, path::Path};

pub use self::{
    csv::write_csv,
    error::{Place, TrialError},
    folder::{Listed, list, read_folder},
    npz::write_npz,
    remark::{Part, Remark, RemarkKind},
    series::Series,
    split::{Split, folds, split},
};

/// A recorded run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trial {
    /// Name of the file without its ending.
    pub name: String,
    /// Controls, one column an actuator, in the model's order; finite. A model without actuators has no column.
    pub control: Series,
    /// Sensors that the log has, in the model's order; NaN where a sample is missing.
    pub sensors: Series,
    /// Full-physics state at the start, of the nominal model's size: time [s], qpos, qvel, and what more the
    /// model has; finite.
    pub initial_state: Option<Vec<f64>>,
    /// States along the run; finite. The columns are those of the full-physics vector, `state[i]`, or, from a
    /// csv that does not have all of it, `qpos[i]`, `qvel[i]`, `act[i]`.
    pub state: Option<Series>,
}

/// What the numbers of a sensor are, where units can be checked.
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
pub struct SensorSignature {
    /// Its name in the MJCF.
    pub name: String,
    /// How many numbers it gives.
    pub dim: usize,
    /// What they are.
    pub kind: SensorQuantity,
}

/// What a model has; the caller fills it from the MJCF, so that this room needs no MuJoCo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signature {
    /// Names of the actuators, in the model's order, `[nu]`.
    pub actuators: Vec<String>,
    /// The sensors, in the model's order.
    pub sensors: Vec<SensorSignature>,
    /// Size of the full-physics state: time, qpos, qvel, and what more the model has.
    pub state_len: usize,
    /// Step of the model [s].
    pub timestep: f64,
}

/// Reads and checks a trial.
///
/// # Errors
/// Where the file cannot be read, does not fit the model, or holds what cannot be a measurement of it.
pub fn read(path: &Path, signature: &Signature) -> Result<(Trial, Vec<Remark>), TrialError> {
    let parts = match ending(path).as_deref() {
        Some("npz") => npz::read(path, signature)?,
        Some("csv") => csv::read(path, signature)?,
        _ => {
            return Err(TrialError::Ending {
                path: path.to_owned(),
            });
        }
    };
    assemble::assemble(path, signature, parts)
}

/// The ending of a file's name, in lower case.
fn ending(path: &Path) -> Option<String> {
    let ending = path.extension().and_then(OsStr::to_str)?;
    Some(ending.to_ascii_lowercase())
}

/// The name of the trial in a file.
fn name_of(path: &Path) -> String {
    path.file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default()
}
