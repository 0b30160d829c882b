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
//! As in `mujoco.sysid`'s `sysid_rollout`: `mj_step` reads sensors at the start of a step, and the row is labelled with
//! the time at its end. **A sensor row labelled t holds the sensors of the state at t - timestep**; a state row labelled t
//! is the state at t. Controls are linear between rows, held before the first and after the last, and held over a model
//! step. The run starts from `initial_state`, at the time that is its first number.
//!
//! # Kept as recorded
//! Rows, times and rates stay as they were recorded; [`Series::resample`] gives another grid. Columns are put into the
//! model's order; a sensor that the log lacks has no column. An oddity is a [`Remark`]; a file that cannot be replayed or
//! compared is refused by a [`TrialError`].

mod assemble;
mod csv;
mod error;
mod list;
mod message;
mod npz;
mod npz_arrays;
mod remark;
mod series;
mod signature;
mod split;
mod tables;
mod times;
mod unit_checks;
mod write_whole;

use std::{ffi::OsStr, path::Path};

pub use self::{
    csv::write_csv,
    error::{Place, TrialError},
    list::{Listed, list, read_folder},
    npz::write_npz,
    remark::{Part, Remark, RemarkKind},
    series::Series,
    signature::{SensorQuantity, SensorSignature, Signature},
    split::{Split, folds, split},
};

/// A recorded run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trial {
    /// Name of the file without its ending.
    pub name: String,
    /// Controls, one column for each actuator in the model's order; finite.
    pub control: Series,
    /// Sensors that the log has, in the model's order; NaN where a sample is missing.
    pub sensors: Series,
    /// Full-physics state at the start, of the nominal model's length: time [s], qpos, qvel and the rest; finite.
    pub initial_state: Option<Vec<f64>>,
    /// States along the run; finite. The columns are those of the full-physics vector, `state[i]`, or, from a
    /// csv that does not have all of it, `qpos[i]`, `qvel[i]`, `act[i]`.
    pub state: Option<Series>,
}

/// Reads and checks a trial.
///
/// # Errors
/// A file that cannot be read, does not fit the model, or cannot be a measurement of it.
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

/// Name of the trial in a file: the file's without its ending.
fn trial_name(path: &Path) -> String {
    path.file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default()
}
