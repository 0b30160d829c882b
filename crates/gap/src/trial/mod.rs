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
mod file_name;
mod kinds;
mod list;
pub(crate) mod message;
mod npz;
mod npz_arrays;
mod read;
mod recorded_run;
mod remark;
mod series;
mod signature;
mod split;
mod tables;
mod times;
mod unit_checks;
mod write_whole;

pub use self::{
    csv::write_csv,
    error::{RowPlace, TrialError},
    list::{Listed, list, read_folder, read_listed},
    npz::write_npz,
    read::read,
    recorded_run::{Steady, Trial},
    remark::{Part, Remark, RemarkKind},
    series::Series,
    signature::{SensorQuantity, SensorSignature, Signature},
    split::{Split, folds, split},
};
