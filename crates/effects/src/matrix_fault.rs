//! Errors of a whole 6 x 6 matrix.

use thiserror::Error;

/// A matrix that no body can have. Rows and columns by the names of their axes.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum MatrixFault {
    /// Two elements that mirror each other differ.
    #[error(
        "the matrix is not symmetric: {row}, {column} is {value} and {column}, {row} is {mirrored} [{unit}], {} apart; \
         expected the same number twice, as the energy of the water asks for",
        (value - mirrored).abs()
    )]
    NotSymmetric {
        row: &'static str,
        column: &'static str,
        value: f64,
        mirrored: f64,
        unit: &'static str,
    },
    /// A negative eigenvalue.
    #[error("{what} has the eigenvalue {eigenvalue}, expected none below 0: {why}{hint}")]
    Indefinite {
        what: &'static str,
        eigenvalue: f64,
        why: &'static str,
        hint: &'static str,
    },
    /// A negative element on the diagonal, where that alone can be checked.
    #[error(
        "{axis}, {axis} is {value} [{unit}], expected at least 0: it would push along the motion{hint}"
    )]
    NegativeDiagonal {
        axis: &'static str,
        value: f64,
        unit: &'static str,
        hint: &'static str,
    },
}
