//! What was noticed in a trial that was accepted all the same.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::columns::{counted, listed};

/// Something that a person should hear about an accepted trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Remark {
    /// For programs.
    #[serde(flatten)]
    pub kind: RemarkKind,
    /// For people: one sentence.
    pub text: String,
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Which part of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The controls.
    Control,
    /// The sensors.
    Sensors,
    /// The states.
    State,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Control => "controls",
            Self::Sensors => "sensors",
            Self::State => "states",
        })
    }
}

/// What was noticed, with its numbers. Times are in [s].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum RemarkKind {
    /// Steps between rows that differ from the median one by more than a hundredth of it.
    UnevenTimes {
        /// Of what.
        part: Part,
        /// How many steps.
        steps: usize,
        /// Out of how many.
        of: usize,
        /// Median step [s].
        median: f64,
        /// Shortest step [s].
        shortest: f64,
        /// Longest step that is no gap [s].
        longest: f64,
    },
    /// Steps so long that rows are missing in them.
    MissingRows {
        /// Of what.
        part: Part,
        /// How many gaps.
        gaps: usize,
        /// How many rows would fill them at the median step.
        rows: u64,
        /// Time at which the longest gap begins [s].
        longest_at: f64,
        /// Length of the longest gap [s].
        longest: f64,
    },
    /// Controls and sensors were sampled at different rates.
    DifferentRates {
        /// Median step of the controls [s].
        control_period: f64,
        /// Median step of the sensors [s].
        sensor_period: f64,
    },
    /// Samples of a sensor that are missing.
    DroppedSamples {
        /// The sensor.
        sensor: String,
        /// How many rows lack at least one of its components.
        rows: usize,
        /// Out of how many.
        of: usize,
    },
    /// A sensor of the model that the log lacks.
    MissingSensor {
        /// The sensor.
        sensor: String,
    },
    /// Components of a vector sensor that the log lacks.
    MissingComponents {
        /// The sensor.
        sensor: String,
        /// The missing columns.
        columns: Vec<String>,
    },
    /// Where the run started is not known.
    MissingInitialState,
    /// No states are recorded along the run.
    MissingStates,
    /// States are recorded in part: some columns of `qpos`, `qvel`, `act`, but not the model's whole state.
    PartialState {
        /// How many numbers a row has, the time counted.
        found: usize,
        /// How many the model's state has.
        expected: usize,
    },
    /// Columns stood in another order than the model's; they were put into the model's.
    Reordered {
        /// Of what.
        part: Part,
    },
    /// Columns or arrays that are neither an actuator's, a sensor's nor a state's, left out.
    SetAside {
        /// Their names.
        names: Vec<String>,
    },
    /// Cells of controls that are empty in rows where other actuators have a sample; filled linearly between
    /// the actuator's own samples, which is what a control does between rows.
    FilledControls {
        /// The actuator.
        actuator: String,
        /// How many cells.
        rows: usize,
        /// Out of how many.
        of: usize,
    },
    /// Every control is constant: the data excite nothing.
    ConstantControls,
    /// These controls are constant, others are not.
    IdleActuators {
        /// The actuators.
        actuators: Vec<String>,
    },
    /// Sensor rows before the first or after the last control, which is held there.
    OutsideControls {
        /// How many rows.
        rows: usize,
        /// Out of how many.
        of: usize,
        /// How far at most [s].
        furthest: f64,
    },
    /// The initial state carries another time than the first control.
    StartTimes {
        /// Time of the initial state [s].
        initial_state: f64,
        /// Time of the first control [s].
        first_control: f64,
    },
    /// An angle that grows beyond two turns without coming back: a joint that revolves, or degrees.
    LargeAngle {
        /// The column.
        column: String,
        /// The largest absolute value.
        largest: f64,
    },
}

impl From<RemarkKind> for Remark {
    fn from(kind: RemarkKind) -> Self {
        let text = sentence(&kind);
        Self { kind, text }
    }
}

/// A remark in words.
fn sentence(kind: &RemarkKind) -> String {
    match kind {
        RemarkKind::UnevenTimes {
            part,
            steps,
            of,
            median,
            shortest,
            longest,
        } => format!(
            "the times of the {part} are uneven: {steps} of {of} steps differ from the median of {median:.6} s by \
             more than a hundredth ({shortest:.6} to {longest:.6} s); the rows are used at their own times"
        ),
        RemarkKind::MissingRows {
            part,
            gaps,
            rows,
            longest_at,
            longest,
        } => format!(
            "rows of the {part} are missing: {}, some {}; the longest gap is {longest:.6} s at {longest_at:.6} s",
            counted(*gaps as u64, "gap"),
            counted(*rows, "row")
        ),
        RemarkKind::DifferentRates {
            control_period,
            sensor_period,
        } => format!(
            "controls and sensors have different rates: a row every {control_period:.6} s and every \
             {sensor_period:.6} s; nothing is resampled"
        ),
        RemarkKind::DroppedSamples { sensor, rows, of } => {
            format!("sensor `{sensor}`: {rows} of {of} samples are missing")
        }
        RemarkKind::MissingSensor { sensor } => {
            format!("sensor `{sensor}` of the model has no sample in the log and is not compared")
        }
        RemarkKind::MissingComponents { sensor, columns } => format!(
            "sensor `{sensor}`: the log lacks {}, which are not compared",
            listed(columns)
        ),
        RemarkKind::MissingInitialState => {
            "the state at the start is not in the log and has to be estimated".to_owned()
        }
        RemarkKind::MissingStates => "the log has no states along the run".to_owned(),
        RemarkKind::PartialState { found, expected } => format!(
            "the log has {found} of the {expected} numbers of the model's full state, the time counted; no state to \
             start from is taken from them"
        ),
        RemarkKind::Reordered { part } => format!(
            "the columns of the {part} stand in another order than the model's; they were matched by name"
        ),
        RemarkKind::SetAside { names } => format!(
            "left out, since they are no signal of the model: {}",
            listed(names)
        ),
        RemarkKind::FilledControls { actuator, rows, of } => format!(
            "actuator `{actuator}` has no sample in {rows} of {of} rows of controls; it is taken as linear between \
             its own samples"
        ),
        RemarkKind::ConstantControls => {
            "every control is constant: the data excite nothing beyond what the initial state does"
                .to_owned()
        }
        RemarkKind::IdleActuators { actuators } => format!(
            "these controls are constant and excite nothing: {}",
            listed(actuators)
        ),
        RemarkKind::OutsideControls { rows, of, furthest } => format!(
            "{rows} of {of} sensor rows lie before the first or after the last control, by up to {furthest:.6} s; \
             the control is held there"
        ),
        RemarkKind::StartTimes {
            initial_state,
            first_control,
        } => format!(
            "the initial state is of {initial_state:.6} s, the first control of {first_control:.6} s"
        ),
        RemarkKind::LargeAngle { column, largest } => format!(
            "`{column}` grows to {largest:.4} without coming back: a revolving joint in radians, or degrees"
        ),
    }
}
