//! Softmax of one row, in a fixed order of sums.

use crate::kernel::Real;

/// Turns scores, at least one, into weights that sum to 1.
pub(super) fn softmax<T: Real>(scores: &mut [T]) {
    let largest = (scores.iter().copied()).fold(scores[0], |a, b| if b > a { b } else { a });
    let mut sum = T::default();
    for score in scores.iter_mut() {
        *score = (*score - largest).exponential();
        sum += *score;
    }
    for score in scores {
        *score /= sum;
    }
}
