//! Shorthand for the parameters of an effect.

use super::Parameter;

impl Parameter {
    /// A parameter with a normal prior about the value that means "no effect", free of bounds.
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
            start: null,
            optional: false,
            shapes: false,
        }
    }

    /// Between two bounds.
    pub(crate) fn within(self, lower: f64, upper: f64) -> Self {
        Self {
            lower,
            upper,
            ..self
        }
    }

    /// One that shapes what the amplitudes do.
    pub(crate) fn shaping(self) -> Self {
        Self {
            shapes: true,
            ..self
        }
    }

    /// With a first fit that starts away from the null, within the bounds that were given.
    pub(crate) fn starting(self, start: f64) -> Self {
        let start = start.clamp(self.lower, self.upper);
        Self { start, ..self }
    }
}
