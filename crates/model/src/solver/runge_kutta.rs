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

/// Butcher tableau whose a_ij is zero except on the first subdiagonal, as those of Euler and RK4 are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tableau {
    /// a_{i,i-1}, the factor of the previous stage's slope in stage i; 0 for the first stage.
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
