//! Products of matrices that are symmetric: half of the work.

use nalgebra::DMatrix;

/// Columns of a product that are computed at once.
const BLOCK: usize = 64;

/// Adds a product that is symmetric; of what lies below the diagonal nothing is promised.
pub(super) fn add_symmetric(into: &mut DMatrix<f64>, left: &DMatrix<f64>, right: &DMatrix<f64>) {
    let all = into.ncols();
    for first in (0..all).step_by(BLOCK) {
        let count = BLOCK.min(all - first);
        let rows = first + count;
        into.view_mut((0, first), (rows, count)).gemm(
            1.0,
            &left.rows(0, rows),
            &right.columns(first, count),
            1.0,
        );
    }
}

/// A' A. A product of matrices, several times as fast as `tr_mul`.
pub(super) fn gram(of: &DMatrix<f64>) -> DMatrix<f64> {
    let mut gram = DMatrix::zeros(of.ncols(), of.ncols());
    add_symmetric(&mut gram, &of.transpose(), of);
    gram.fill_lower_triangle_with_upper_triangle();
    gram
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gram_matrix_is_the_product() {
        let of = DMatrix::from_fn(7, 2 * BLOCK + 5, |row, column| {
            ((row * 31 + column * 7) as f64).sin()
        });
        assert!((gram(&of) - of.tr_mul(&of)).amax() < 1e-12);
    }
}
