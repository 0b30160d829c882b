//! Mean and spread by hand.

use super::*;

#[test]
fn mean_and_spread_are_those_of_the_definition() {
    let spread = MeanSd::from_values(&[1.0, 2.0, 3.0]).expect("values");
    assert!((spread.mean - 2.0).abs() < 1e-15 && (spread.sd - 1.0).abs() < 1e-15);
    assert_eq!(spread.count, 3);
    let one = MeanSd::from_values(&[4.0]).expect("a value");
    assert!((one.mean - 4.0).abs() < 1e-15 && one.sd.abs() < 1e-15);
    assert_eq!(MeanSd::from_values(&[]), None);
}
