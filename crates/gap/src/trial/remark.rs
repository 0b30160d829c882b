//! Oddities of an accepted trial.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::message::{counted, listed};

/// An oddity of an accepted trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Remark {
    /// The oddity, for programs.
    #[serde(flatten)]
    pub kind: RemarkKind,
    /// The same in one sentence.
    pub text: String,
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// A part of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Part {
    Control,
    Sensors,
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

/// An oddity, with its numbers. Times are in [s]; `of` is the number of all rows, or of all steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum RemarkKind {
    /// Steps between rows that differ from the median step by more than a hundredth of it; `longest` is the longest that
    /// is no gap.
    UnevenTimes {
        part: Part,
        steps: usize,
        of: usize,
        median: f64,
        shortest: f64,
        longest: f64,
    },
    /// Gaps: steps that would hold further rows at the median step; `rows` would fill them all.
    MissingRows {
        part: Part,
        gaps: usize,
        rows: u64,
        longest_at: f64,
        longest: f64,
    },
    /// Controls and sensors were sampled at different rates.
    DifferentRates {
        control_period: f64,
        sensor_period: f64,
    },
    /// Samples of a sensor that are missing.
    DroppedSamples {
        sensor: String,
        rows: usize,
        of: usize,
    },
    /// A sensor of the model that the log lacks.
    MissingSensor { sensor: String },
    /// Components of a vector sensor that the log lacks.
    MissingComponents {
        sensor: String,
        columns: Vec<String>,
    },
    /// The log has no initial state.
    MissingInitialState,
    /// No states are recorded along the run.
    MissingStates,
    /// Some columns of `qpos`, `qvel`, `act`, but not the whole state: `found` of `expected` numbers, the time counted.
    PartialState { found: usize, expected: usize },
    /// Columns in another order than the model's, reordered.
    Reordered { part: Part },
    /// Columns or arrays of no actuator, sensor or state, left out.
    SetAside { names: Vec<String> },
    /// Empty cells of a control in rows where other actuators have a sample, filled linearly between the actuator's own
    /// samples.
    FilledControls {
        actuator: String,
        rows: usize,
        of: usize,
    },
    /// Every control is constant, so that the data excite nothing.
    ConstantControls,
    /// These controls are constant, others are not.
    IdleActuators { actuators: Vec<String> },
    /// Sensor rows before the first or after the last control, by at most `furthest`; the control is held there.
    OutsideControls {
        rows: usize,
        of: usize,
        furthest: f64,
    },
    /// The initial state carries another time than the first control.
    StartTimes {
        initial_state: f64,
        first_control: f64,
    },
    /// Joints of which a table of steady states gives nothing.
    HeldJoints { joints: Vec<String> },
    /// An angle that grows beyond two turns without coming back: a joint that revolves, or degrees.
    LargeAngle { column: String, largest: f64 },
}

impl From<RemarkKind> for Remark {
    fn from(kind: RemarkKind) -> Self {
        let text = sentence(&kind);
        Self { kind, text }
    }
}

/// The sentence of a remark.
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
        RemarkKind::HeldJoints { joints } => format!(
            "the table gives neither position nor velocity of the joints {}: they stand still where the model has them",
            listed(joints)
        ),
        RemarkKind::LargeAngle { column, largest } => format!(
            "`{column}` grows to {largest:.4} without coming back: a revolving joint in radians, or degrees"
        ),
    }
}
