//! A parameter of an effect: name, unit, null, prior and bounds.

use super::physical::Physical;

/// One parameter of an effect on a target.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, as in files.
    pub name: String,
    /// Unit; `1` for a number without one.
    pub unit: &'static str,
    /// The value that means "no effect".
    pub null: f64,
    /// Standard deviation of the normal prior about [`Parameter::null`], before the bounds.
    pub prior_sd: f64,
    /// Least value that a fit looks at.
    pub lower: f64,
    /// Greatest value that a fit looks at.
    pub upper: f64,
    /// Values that a file may have: what physics allows, whatever the model.
    pub physical: Physical,
    /// First value of a fit: the null, or a value beside it where the model has no derivative at the null (a delay, a
    /// frequency).
    pub start: f64,
    /// True where a file may leave it out; it is then at its null.
    pub optional: bool,
    /// The value where a file leaves it out; `None`: a file gives it, or it is [`Parameter::optional`].
    pub left_out: Option<f64>,
    /// True where it shapes the effect's amplitudes (a frequency, a length, a place): it has no influence while they are
    /// zero.
    pub shapes: bool,
}

impl Parameter {
    /// A parameter with a normal prior about its null, without bounds; physics allows any value.
    pub(crate) fn about(
        name: impl Into<String>,
        unit: &'static str,
        null: f64,
        prior_sd: f64,
    ) -> Self {
        Self {
            name: name.into(),
            unit,
            null,
            prior_sd,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            physical: Physical::Any,
            start: null,
            optional: false,
            left_out: None,
            shapes: false,
        }
    }

    /// The same, with other values that physics allows.
    pub(crate) fn physically(self, physical: Physical) -> Self {
        Self { physical, ..self }
    }

    /// The same, fitted between two bounds.
    pub(crate) fn within(self, lower: f64, upper: f64) -> Self {
        Self {
            lower,
            upper,
            ..self
        }
    }

    /// The same, with a value where a file leaves it out.
    pub(crate) fn left_out_as(self, value: f64) -> Self {
        Self {
            left_out: Some(value),
            ..self
        }
    }

    /// The same, shaping the amplitudes.
    pub(crate) fn shaping(self) -> Self {
        Self {
            shapes: true,
            ..self
        }
    }

    /// The same, with a first fit that starts away from the null; call it after [`Parameter::within`].
    pub(crate) fn starting(self, start: f64) -> Self {
        let start = start.clamp(self.lower, self.upper);
        Self { start, ..self }
    }
}
