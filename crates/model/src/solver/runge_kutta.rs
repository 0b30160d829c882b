//! Explicit Runge-Kutta methods of one step a sample period: Euler and the classical method of order 4.
//!
//! ```text
//! Euler  0 |        RK4   0  |
//!        --+---           1/2| 1/2
//!          | 1            1/2|  0  1/2
//!                          1 |  0   0   1
//!                         ---+----------------
//!                            | 1/6 1/3 1/3 1/6
//! ```

/// Rows of a Butcher tableau; a_ij is zero but on the first subdiagonal for both methods of one step a period.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tableau {
    /// a_{i,i-1}: how far along the previous slope stage i is taken; 0 for the first stage.
    pub(crate) along_previous: &'static [f64],
    /// b_i.
    pub(crate) weights: &'static [f64],
}

/// Order 1.
pub(super) const EULER: Tableau = Tableau {
    along_previous: &[0.0],
    weights: &[1.0],
};

/// Order 4.
pub(super) const RK4: Tableau = Tableau {
    along_previous: &[0.0, 0.5, 0.5, 1.0],
    weights: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
};
