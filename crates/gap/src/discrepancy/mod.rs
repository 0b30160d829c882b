//! The discrepancy between a right hypothesis and the data: AR(1) noise, autocorrelation, error of form, adequacy.

pub(crate) mod adequacy;
pub(crate) mod autocorrelation;
pub(crate) mod noise_estimation;
pub(crate) mod noise_model;
pub(crate) mod simulated_residuals;
pub(crate) mod variance_inflation;
