//! The problem linearised about the nominal, and the Gauss-Newton fit of a hypothesis with its Laplace evidence.

pub(crate) mod finite_difference;
pub(crate) mod gauss_newton;
pub(crate) mod hypothesis;
pub(crate) mod intervals;
pub(crate) mod laplace;
pub(crate) mod linearize;
pub(crate) mod linearized_problem;
pub(crate) mod payload;
pub(crate) mod segmented_problem;
pub(crate) mod sensitivities;
pub(crate) mod start_projection;
pub(crate) mod truncated_normal;
