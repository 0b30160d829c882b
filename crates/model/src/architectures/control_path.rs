//! A smooth path through the samples, as the control of a differential equation: its derivative at given times.
//!
//! Knots are the samples, one unit of time apart. Two paths:
//!
//! - the natural cubic spline, whose second derivative vanishes at both ends: it needs the whole trajectory, as in the
//!   paper and in P. Kidger et al., "Neural Controlled Differential Equations for Irregular Time Series", NeurIPS 2020;
//! - the cubic Hermite spline with backward differences for slopes, which up to sample k needs nothing later (J. Morrill
//!   et al., "Neural Controlled Differential Equations for Online Prediction Tasks", arXiv:2106.11028).
//!
//! Time itself is one channel more, so that the state can change while nothing moves.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::solver::Solver;

/// The derivative of the channel of time, whose unit is the sample.
pub(crate) const CLOCK: f64 = 1.0;

/// Kind of path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Control {
    /// Natural cubic spline of the whole trajectory, the future included; a simulation has only the past and takes
    /// [`Control::Hermite`] in its place.
    Natural,
    /// Cubic Hermite with backward differences.
    #[default]
    Hermite,
}

impl Control {
    /// Every path, for error messages and help texts.
    pub const ALL: [Self; 2] = [Self::Natural, Self::Hermite];
}

impl fmt::Display for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Natural => "natural",
            Self::Hermite => "hermite",
        })
    }
}

/// A name that is not that of a path.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown control `{0}`: there are natural and hermite")]
pub struct UnknownControl(pub String);

impl FromStr for Control {
    type Err = UnknownControl;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|control| control.to_string() == name)
            .ok_or_else(|| UnknownControl(name.to_owned()))
    }
}

/// Slope of the path in a stage at time u between the samples `now` and `after`; `before` precedes them. Euler's method
/// takes the whole increment, so that its path ends at the sample.
pub(crate) fn causal(solver: Solver, [before, now, after]: [f64; 3], u: f64) -> f64 {
    match solver {
        Solver::Euler => after - now,
        Solver::Rk4 | Solver::DormandPrince => hermite(before, now, after, u),
    }
}

/// X'(u) between the samples `now` and `after`, `before` the one in front of them; 0 <= u <= 1.
fn hermite(before: f64, now: f64, after: f64, u: f64) -> f64 {
    let (left, right) = (now - before, after - now);
    left + (right - left) * (4.0 - 3.0 * u) * u
}

/// X' of the natural spline through x [T] on each of its T - 1 intervals, at each time u in `nodes`: [T-1, nodes].
pub(crate) fn natural(x: &[f64], nodes: &[f64]) -> Vec<f64> {
    let bends = second_derivatives(x);
    let mut slopes = Vec::with_capacity(x.len().saturating_sub(1) * nodes.len());
    for (pair, bend) in x.windows(2).zip(bends.windows(2)) {
        for u in nodes {
            slopes.push(
                pair[1] - pair[0] - bend[0] * ((1.0 - u).powi(2) / 2.0 - 1.0 / 6.0)
                    + bend[1] * (u * u / 2.0 - 1.0 / 6.0),
            );
        }
    }
    slopes
}

/// At the knots, zero at the ends: the tridiagonal system M_{i-1} + 4 M_i + M_{i+1} = 6 (x_{i-1} - 2 x_i + x_{i+1}).
fn second_derivatives(x: &[f64]) -> Vec<f64> {
    let mut bends = vec![0.0; x.len()];
    if x.len() < 3 {
        return bends;
    }
    let inner = x.len() - 2;
    let mut upper = vec![0.0; inner];
    for i in 0..inner {
        let right = 6.0 * (x[i] - 2.0 * x[i + 1] + x[i + 2]);
        let (above, known) = if i == 0 {
            (0.0, 0.0)
        } else {
            (upper[i - 1], bends[i])
        };
        let pivot = 4.0 - above;
        upper[i] = 1.0 / pivot;
        bends[i + 1] = (right - known) / pivot;
    }
    for i in (0..inner.saturating_sub(1)).rev() {
        bends[i + 1] -= upper[i] * bends[i + 2];
    }
    bends
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Golden values by `python -c "import numpy as np; from scipy.interpolate import CubicSpline; x = [0.3, -1.2, 2.5, 0.7, 0.9, -3.1];
    /// print(CubicSpline(np.arange(6), x, bc_type='natural')(np.arange(5)[:, None] + [0, 0.25, 1], 1).ravel().tolist())"`.
    #[test]
    fn the_natural_spline_is_scipys() {
        let expected: [f64; 15] = [
            -3.346411483253589,
            -3.000209330143541,
            2.1928229665071775,
            2.1928229665071775,
            4.206429425837322,
            1.1751196172248803,
            1.1751196172248803,
            -1.4317583732057415,
            -1.1933014354066986,
            -1.1933014354066986,
            0.37685406698564616,
            -1.2019138755980856,
            -1.2019138755980856,
            -3.0381578947368415,
            -5.399043062200957,
        ];
        let found = natural(&[0.3, -1.2, 2.5, 0.7, 0.9, -3.1], &[0.0, 0.25, 1.0]);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn a_line_has_its_own_slope_everywhere() {
        let line: Vec<f64> = (0..7).map(|i| 2.0 - 0.5 * f64::from(i)).collect();
        for length in 2..7 {
            let found = natural(&line[..length], &[0.0, 0.3, 1.0]);
            assert_eq!(found.len(), 3 * (length - 1));
            assert!(found.iter().all(|slope| (slope + 0.5).abs() < 1e-12));
        }
        assert!(natural(&line[..1], &[0.5]).is_empty());
        assert!((hermite(2.0, 1.5, 1.0, 0.3) + 0.5).abs() < 1e-12);
    }

    proptest! {
        /// Each path goes through its samples: its slope integrates to their difference (Simpson's rule is exact), and
        /// does not jump at a sample.
        #[test]
        fn paths_go_through_the_samples(x in prop::collection::vec(-5.0f64..5.0, 3..12)) {
            let nodes = [0.0, 0.5, 1.0];
            let spline = natural(&x, &nodes);
            for i in 1..x.len() - 1 {
                let online: Vec<f64> = nodes.iter().map(|u| hermite(x[i - 1], x[i], x[i + 1], *u)).collect();
                for slopes in [&spline[3 * i..][..3], &online] {
                    let area = (slopes[0] + 4.0 * slopes[1] + slopes[2]) / 6.0;
                    prop_assert!((area - (x[i + 1] - x[i])).abs() < 1e-9);
                }
                prop_assert!((spline[3 * i - 1] - spline[3 * i]).abs() < 1e-9);
                prop_assert!((online[0] - (x[i] - x[i - 1])).abs() < 1e-12);
                prop_assert!((online[2] - (x[i + 1] - x[i])).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        for control in Control::ALL {
            assert_eq!(control.to_string().parse(), Ok(control));
        }
        let error = "linear".parse::<Control>().expect_err("no such path");
        assert_eq!(
            error.to_string(),
            "unknown control `linear`: there are natural and hermite"
        );
    }
}
