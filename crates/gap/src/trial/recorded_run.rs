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
    /// Positions of prescribed joints [m or rad], a column for each under the joint's name, each row labelled as sensors are;
    /// finite.
    pub prescribed: Option<Series>,
    /// Set for a table of steady states: all times are numbers of its rows, from 1.
    pub steady: Option<Steady>,
}

/// Columns of a table of steady states beside controls and mean readings, by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steady {
    /// Imposed positions [m or rad] and velocities [m/s or rad/s], `JOINT` and `JOINT_vel`; finite.
    pub motion: Series,
    /// Standard deviations of mean readings, under the names of the sensors' columns; NaN where none is given.
    pub deviations: Series,
}
