//! A recorded run, as it is kept.

use super::series::Series;

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
