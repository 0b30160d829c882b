//! Inflation of the variance of whitened residuals: undeclared noise, its autocorrelation, and the error of form.

use crate::{
    discrepancy::{autocorrelation, noise_estimation},
    fit::{hypothesis::Fit, linearized_problem::LinearizedProblem},
    options::DiscrepancyOptions,
};

/// Inflation for the error of form. `explained`: decrease of the misfit by the effects. The catalogue's form of a strong
/// effect differs from the real one, and a fraction of what it explains must not be taken for a further effect.
pub(crate) fn form_inflation(explained: f64, options: &DiscrepancyOptions) -> f64 {
    let unexplained = options.unexplained_form_error;
    1.0 + unexplained * unexplained * explained.max(0.0) / options.form_error_directions
}

/// The inflation under the best fit; `nothing`: misfit of the fit without effects.
pub(crate) fn variance_inflation(
    linearized: &LinearizedProblem<'_>,
    best: &Fit,
    nothing: f64,
    seed: u64,
) -> f64 {
    let options = &linearized.problem.options.discrepancy;
    // What a fit leaves is slow noise that nobody declared, or an error of form: whichever may overstate more.
    let seen = autocorrelation::by_channel(
        linearized.problem.channels.len(),
        &linearized.problem.options.discrepancy,
        &best.residuals,
    );
    let of_form =
        autocorrelation::noise_inflation(&seen) * form_inflation(nothing - best.misfit, options);
    let of_noise = autocorrelation::noise_inflation(&noise_estimation::corrected(
        linearized, best, &seen, seed,
    ));
    of_form.max(of_noise)
}
