//! Why a stage cannot go on. "Cannot tell" is not among the reasons: it is an answer.

use thiserror::Error;

use crate::{plant::PlantError, trial::message::listed};

/// Why a stage stopped.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GapError {
    /// The model cannot be built or stepped.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The nominal model blows up by itself.
    #[error(
        "the nominal model diverges by itself: trial `{trial}`, started at {start:.3} s from the measured \
         state, is no longer finite after {after:.3} s; a model has to follow the robot for {expected:.1} s \
         before its errors can be studied. Check masses, gains and the timestep ({timestep} s)"
    )]
    NominalDiverges {
        /// Name of the trial.
        trial: String,
        /// Start of the rollout [s].
        start: f64,
        /// Survived [s].
        after: f64,
        /// Length of a segment [s].
        expected: f64,
        /// Step of the model [s].
        timestep: f64,
    },
    /// Nothing can be compared.
    #[error(
        "no sensor of the model has a sample in the trials {}; the model's sensors: {}",
        listed(.trials),
        listed(.sensors)
    )]
    NothingMeasured {
        /// Names of the trials.
        trials: Vec<String>,
        /// The model's sensors.
        sensors: Vec<String>,
    },
    /// More readings a row than memory is there for.
    #[error(
        "the trials have {found} numbers a row for the sensors {}; expected at most {most}: leave out of the log what \
         repeats other sensors", listed(.sensors)
    )]
    TooMuchMeasured {
        /// Numbers a row.
        found: usize,
        /// Numbers a row, at most.
        most: usize,
        /// The sensors that are compared.
        sensors: Vec<String>,
    },
    /// Every degree of freedom is prescribed, and no sensor tells of forces.
    #[error(
        "every degree of freedom is prescribed in the trials {}, so the sensors {} say nothing of the model: \
         forces are the output then. A `force` or `torque` sensor that is logged is needed; the model's sensors: {}",
        listed(.trials),
        listed(.compared),
        listed(.sensors)
    )]
    NoForces {
        /// Names of the trials.
        trials: Vec<String>,
        /// The sensors that the trials have.
        compared: Vec<String>,
        /// The model's sensors.
        sensors: Vec<String>,
    },
    /// A trial too short for one segment.
    #[error("trial `{trial}` has {found} rows with a reading; at least {expected} are needed")]
    TooShort {
        /// Name of the trial.
        trial: String,
        /// Rows there are.
        found: usize,
        /// Rows needed.
        expected: usize,
    },
    /// Asked to stop.
    #[error("stopped; what was finished is kept, and the same command goes on from there")]
    Stopped,
    /// The uncertainty file does not fit.
    #[error("{0}")]
    Uncertainty(String),
}
