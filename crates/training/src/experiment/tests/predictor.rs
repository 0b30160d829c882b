//! Forces that are no number.

use super::held;

#[test]
fn a_lost_force_is_far_off_and_finite() {
    let found = [1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(|force| held(force, 5.0));
    assert_eq!(found, [1.0, 5.0, 5.0, -5.0]);
}
