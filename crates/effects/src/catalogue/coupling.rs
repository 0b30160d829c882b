//! Off-diagonal elements of an effect's 6 x 6 matrix, which its diagonal form neglects.

/// Symmetric elements, a pair of axes each, of the size that the diagonal allows: the root of the product of the two
/// diagonal elements (a positive semidefinite matrix has none larger). Each as the matrix's product with `x` [6].
pub(super) fn symmetric(p: &[f64], x: &[f64; 6]) -> Vec<[f64; 6]> {
    let pairs = (0..6).flat_map(|i| (i + 1..6).map(move |j| (i, j)));
    pairs
        .map(|(i, j)| {
            let size = (p[i] * p[j]).max(0.0).sqrt();
            let mut product = [0.0; 6];
            product[i] = size * x[j];
            product[j] = size * x[i];
            product
        })
        .collect()
}
