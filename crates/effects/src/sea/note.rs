//! Notes on a sea that is accepted.

use std::fmt;

/// A limit of the theory that a sea reaches.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SeaNote {
    /// The waves are steep, or long in shallow water.
    Steep {
        /// Amplitude of the second harmonic that Stokes' second order adds, in parts of the first.
        second_harmonic: f64,
    },
    /// A hull is large beside a part of the waves.
    LargeHull {
        /// Diameter of the hull [m].
        diameter: f64,
        /// Length of the shortest wave with noticeable energy [m].
        shortest_length: f64,
        /// Share of the waves' energy in components shorter than five diameters, 0 to 1.
        share: f64,
        /// Force of a wave of the shortest length on an upright cylinder of this diameter, in parts of the long-wave force.
        ratio: f64,
    },
}

impl fmt::Display for SeaNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Steep { second_harmonic } => write!(
                f,
                "the waves are steep for linear theory: the second order of Stokes makes crests {:.0} % higher, and linear \
                 theory is good below 10 %",
                100.0 * second_harmonic
            ),
            Self::LargeHull {
                diameter,
                shortest_length,
                share,
                ratio,
            } => write!(
                f,
                "a hull of {diameter} m is large beside waves as short as {shortest_length:.3} m ({:.0} % of the energy is \
                 in waves shorter than five diameters): it scatters them, and undisturbed pressure with a constant added \
                 mass over-predicts their force (an upright cylinder feels {:.0} % of it in the shortest)",
                100.0 * share,
                100.0 * ratio
            ),
        }
    }
}
