//! The patched model: its text, and a record of what was written.

use std::fmt;

use hydro_effects::Id;

/// An effect that was written, and its form.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Written {
    pub effect: Id,
    pub target: String,
    /// Its form in the MJCF, in words.
    pub form: String,
}

/// A patched model.
#[derive(Clone, Debug, PartialEq)]
pub struct Patched {
    /// The text.
    pub xml: String,
    /// The effects, in the order of the request.
    pub written: Vec<Written>,
    /// Values of the nominal model that were replaced; those that could not be are in the remarks.
    pub numbers: Vec<Renumbered>,
    /// Remarks for a person.
    pub remarks: Vec<String>,
}

/// A value of the nominal model that was replaced.
#[derive(Clone, Debug, PartialEq)]
pub struct Renumbered {
    /// Index in [`Request::numbers`](super::Request::numbers).
    pub number: usize,
    /// Its name: `hull.mass`.
    pub name: String,
    /// Its value in the nominal model.
    pub from: f64,
    /// Its value as written.
    pub to: f64,
    /// Unit of both; `x nominal` where they are factors on the nominal value.
    pub unit: &'static str,
}

impl fmt::Display for Renumbered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            from,
            to,
            unit,
            ..
        } = self;
        let short = |value: &f64| {
            let rounded: f64 = format!("{value:.4e}").parse().unwrap_or(*value);
            super::xml_edit::number(rounded)
        };
        write!(f, "{name} {} -> {} {unit}", short(from), short(to))
    }
}
