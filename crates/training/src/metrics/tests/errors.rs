//! Errors by hand.

use super::*;

#[test]
fn errors_are_those_of_the_definition() {
    let mut sums = ErrorSums::new(1);
    // Clean 0, 2, 4: deviation sqrt(8/3). Hydrodynamic part 0, 1, 2: sqrt(2/3). Errors 1, -1, 2; perturbed by 1.
    for (predicted, clean, hydrostatic) in [(1.0, 0.0, 0.0), (1.0, 2.0, 1.0), (6.0, 4.0, 2.0)] {
        sums.add(&[predicted], &[clean], &[hydrostatic], &[clean + 1.0]);
    }
    let found = sums.errors();
    let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-12, "{got} {want}");
    close(found.mae[0], 4.0 / 3.0);
    close(found.rmse[0], 2f64.sqrt());
    close(found.pooled, 2f64.sqrt() / (8f64 / 3.0).sqrt());
    close(found.pooled_hydrodynamic, 2f64.sqrt() / (2f64 / 3.0).sqrt());
    close(found.pooled_mae, 4.0 / 3.0 / (8f64 / 3.0).sqrt());
    close(found.rmse_perturbed[0], (5f64 / 3.0).sqrt());
}
