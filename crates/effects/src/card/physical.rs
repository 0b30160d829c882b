//! Values that physics allows, whatever the model's sizes: the bounds of files written by hand.

use std::fmt;

/// Greatest magnitude of a value, in SI units: beyond a tanker's added moment of inertia (1e13 kg m^2), and small enough that
/// no product of it with bounded motions overflows. Files with more are refused; the laws of force hold their parameters
/// within it.
pub const LARGEST: f64 = 1e18;

/// Values that physics allows for a parameter. Bounds of a fit ([`crate::Parameter::lower`]) depend on the model and are
/// narrower; a file may say more than a fit would look for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Physical {
    /// Any finite value up to [`LARGEST`] in magnitude: a force, a moment, a place, a phase.
    #[default]
    Any,
    /// Zero or more: a mass, a coefficient of drag, a delay, a width, a gain.
    NotNegative,
    /// More than zero: a frequency, a rate, a length to divide by.
    Positive,
    /// Between two bounds, both included.
    Between(f64, f64),
}

impl Physical {
    /// True for a value that is allowed; false for one that is not a number.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::Any => value.abs() <= LARGEST,
            Self::NotNegative => (0.0..=LARGEST).contains(&value),
            Self::Positive => value > 0.0 && value <= LARGEST,
            Self::Between(lower, upper) => (lower..=upper).contains(&value),
        }
    }
}

impl fmt::Display for Physical {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => write!(f, "-{LARGEST:e} to {LARGEST:e}"),
            Self::NotNegative => write!(f, "0 to {LARGEST:e}"),
            Self::Positive => write!(f, "more than 0, up to {LARGEST:e}"),
            Self::Between(lower, upper) => write!(f, "{lower} to {upper}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_range_holds_what_it_says() {
        let ranges = [
            Physical::Any,
            Physical::NotNegative,
            Physical::Positive,
            Physical::Between(-1.0, 2.0),
        ];
        let values = [-1e19, -1e18, -1.5, -1.0, 0.0, 1.0, 2.0, 1e18, 1e19];
        let held = ranges.map(|range| values.map(|value| range.holds(value)));
        let (y, n) = (true, false);
        assert_eq!(
            held,
            [
                [n, y, y, y, y, y, y, y, n],
                [n, n, n, n, y, y, y, y, n],
                [n, n, n, n, n, y, y, y, n],
                [n, n, n, y, y, y, y, n, n],
            ]
        );
        assert!(ranges.iter().all(|range| !range.holds(f64::NAN)));
        let words = ranges.map(|range| range.to_string());
        assert_eq!(
            words,
            [
                "-1e18 to 1e18",
                "0 to 1e18",
                "more than 0, up to 1e18",
                "-1 to 2"
            ]
        );
    }
}
