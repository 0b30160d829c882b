//! Linear plus quadratic drag on the base twist, fitted by least squares: the model that a user would
//! write by hand, and a baseline of the learned one.
//!
//! `w = -rho / rho_0 (D_L nu + D_Q |nu| nu)` with full 6 x 6 matrices, `nu = (v, omega)` in the base frame
//! and `|nu| nu` taken component by component (Fossen, *Handbook of Marine Craft Hydrodynamics and
//! Motion Control*, 2011, section 6.4). Buoyancy is no part of it: it is exact in every baseline.

mod baseline;
mod fit;
mod law;

pub use self::{
    baseline::{drag_predictions, fit_drag, twist_and_density},
    fit::{DragError, DragFit},
    law::Drag,
};
