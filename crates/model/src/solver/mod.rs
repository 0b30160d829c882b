//! Explicit Runge-Kutta methods that step the force from one sample to the next.
//!
//! The latent h is held over the sample period, since a simulation does not know a later one, so the field depends on the
//! force alone: k_i = f(F + sum_{j<i} a_ij k_j), F' = F + sum_i b_i k_i, with the sample period as the unit of time. Euler and RK4 take one
//! step a period; Dormand-Prince ([`Solver::DormandPrince`]) as many as the field asks for.

pub(crate) mod dormand_prince;
mod runge_kutta;

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

pub(crate) use self::runge_kutta::Tableau;
use self::runge_kutta::{EULER, RK4};

/// Method of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Solver {
    /// Order 1, one evaluation a step.
    #[default]
    Euler,
    /// The classical method of order 4, four evaluations a step.
    Rk4,
    /// Dormand-Prince 5(4): order 5, with steps as long as the embedded method of order 4 allows. The first step of a
    /// sample period takes seven evaluations, every other one six.
    #[serde(rename = "dopri5")]
    DormandPrince,
}

impl Solver {
    /// Every method, for error messages and help texts.
    pub const ALL: [Self; 3] = [Self::Euler, Self::Rk4, Self::DormandPrince];

    /// The methods of one step a sample period.
    pub const FIXED: [Self; 2] = [Self::Euler, Self::Rk4];

    /// Tableau of the one step of a sample period; `None` for [`dormand_prince`], which takes several steps. A field that
    /// does not read the force has a constant slope, for which Euler's method is exact.
    pub(crate) fn stages(self, field_sees_force: bool) -> Option<Tableau> {
        if field_sees_force {
            self.tableau()
        } else {
            Self::Euler.tableau()
        }
    }

    /// The tableau of a method of one step a sample period; `None` for Dormand-Prince.
    pub(crate) fn tableau(self) -> Option<Tableau> {
        match self {
            Self::Euler => Some(EULER),
            Self::Rk4 => Some(RK4),
            Self::DormandPrince => None,
        }
    }
}

impl fmt::Display for Solver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Euler => "euler",
            Self::Rk4 => "rk4",
            Self::DormandPrince => "dopri5",
        })
    }
}

/// A name that is not that of a solver.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown solver `{0}`: there are euler, rk4 and dopri5")]
pub struct UnknownSolver(pub String);

impl FromStr for Solver {
    type Err = UnknownSolver;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|solver| solver.to_string() == name)
            .ok_or_else(|| UnknownSolver(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_of_a_consistent_method_sum_to_one() {
        for solver in Solver::FIXED {
            let tableau = solver.tableau().expect("of one step");
            assert!(
                (tableau.weights.iter().sum::<f64>() - 1.0).abs() < 1e-15,
                "{solver}"
            );
            assert_eq!(tableau.weights.len(), tableau.along_previous.len());
        }
    }

    /// dF/dt = -F from 1: the error at t = 1 falls by 2^order when the step is halved.
    #[test]
    fn each_method_converges_at_its_order() {
        let error = |solver: Solver, steps: u32| {
            let tableau = solver.tableau().expect("of one step");
            let step = 1.0 / f64::from(steps);
            let mut force = 1.0;
            for _ in 0..steps {
                let (mut slope, mut change) = (0.0, 0.0);
                for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
                    slope = -step * (force + along * slope);
                    change += weight * slope;
                }
                force += change;
            }
            (force - (-1.0f64).exp()).abs()
        };
        for (solver, order) in [(Solver::Euler, 1.0), (Solver::Rk4, 4.0)] {
            let observed = (error(solver, 40) / error(solver, 80)).log2();
            assert!((observed - order).abs() < 0.1, "{solver}: order {observed}");
        }
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        for solver in Solver::ALL {
            assert_eq!(solver.to_string().parse(), Ok(solver));
            let card = serde_json::to_value(solver).expect("serialises");
            assert_eq!(card, solver.to_string());
        }
        let error = "rk5".parse::<Solver>().expect_err("no such solver");
        assert_eq!(
            error.to_string(),
            "unknown solver `rk5`: there are euler, rk4 and dopri5"
        );
    }
}
