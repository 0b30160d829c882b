//! Least squares over a chain: unknowns a link, each tied to its neighbours alone.
//!
//! The normal matrix is block tridiagonal, so a trial of any length costs in proportion to it. The same
//! elimination gives the covariance of every link and the determinant (the fixed-interval smoother of
//! H. E. Rauch, F. Tung, C. T. Striebel, AIAA Journal 3, 1965, in information form).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// `H u = g` for the links one after the other.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// Blocks on the diagonal [m, m].
    pub(super) diagonal: Vec<DMatrix<f64>>,
    /// Blocks below it [m, m]: row of the next link, column of this one; one fewer.
    pub(super) below: Vec<DMatrix<f64>>,
    /// Right-hand side [m].
    pub(super) right: Vec<DVector<f64>>,
}

/// Solution of a chain.
#[derive(Clone, Debug)]
pub(super) struct Solved {
    /// Unknowns of every link.
    pub(super) unknowns: Vec<DVector<f64>>,
    /// Their covariances.
    pub(super) covariances: Vec<DMatrix<f64>>,
    /// Logarithm of the determinant of `H`.
    pub(super) log_determinant: f64,
}

impl Chain {
    /// Without any tie.
    pub(super) fn new(links: usize, unknowns: usize) -> Self {
        Self {
            diagonal: vec![DMatrix::zeros(unknowns, unknowns); links],
            below: vec![DMatrix::zeros(unknowns, unknowns); links.saturating_sub(1)],
            right: vec![DVector::zeros(unknowns); links],
        }
    }

    /// Adds `|residual - columns u|^2` of one link.
    pub(super) fn add(&mut self, link: usize, columns: &DMatrix<f64>, residual: &DVector<f64>) {
        self.diagonal[link] += columns.tr_mul(columns);
        self.right[link] += columns.tr_mul(residual);
    }

    /// Adds `|residual - this u - next v|^2` of a link's unknowns u and the next one's v.
    pub(super) fn tie(
        &mut self,
        link: usize,
        this: &DMatrix<f64>,
        next: &DMatrix<f64>,
        residual: &DVector<f64>,
    ) {
        self.add(link, this, residual);
        self.add(link + 1, next, residual);
        self.below[link] += next.tr_mul(this);
    }

    /// Solves; none where the matrix is not positive.
    pub(super) fn solve(&self) -> Option<Solved> {
        let links = self.diagonal.len();
        let mut factors: Vec<Cholesky<f64, Dyn>> = Vec::with_capacity(links);
        let mut reduced: Vec<DVector<f64>> = Vec::with_capacity(links);
        for link in 0..links {
            let mut block = self.diagonal[link].clone();
            let mut right = self.right[link].clone();
            if let (Some(before), Some(carried)) = (factors.last(), reduced.last()) {
                let below = &self.below[link - 1];
                block -= below * before.solve(&below.transpose());
                right -= below * before.solve(carried);
            }
            factors.push(block.cholesky()?);
            reduced.push(right);
        }
        let log_determinant = factors
            .iter()
            .map(|factor| {
                let diagonal = factor.l_dirty().diagonal();
                2.0 * diagonal.iter().map(|value| value.ln()).sum::<f64>()
            })
            .sum();
        let mut unknowns: Vec<DVector<f64>> = Vec::with_capacity(links);
        let mut covariances: Vec<DMatrix<f64>> = Vec::with_capacity(links);
        for link in (0..links).rev() {
            let mut right = reduced[link].clone();
            let mut covariance = factors[link].inverse();
            if let (Some(later), Some(spread)) = (unknowns.last(), covariances.last()) {
                let below = &self.below[link];
                right -= below.tr_mul(later);
                let gain = factors[link].solve(&below.transpose());
                covariance += &gain * spread * gain.transpose();
            }
            unknowns.push(factors[link].solve(&right));
            covariances.push(covariance);
        }
        unknowns.reverse();
        covariances.reverse();
        Some(Solved {
            unknowns,
            covariances,
            log_determinant,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_chain_is_what_the_whole_matrix_gives() {
        let (links, m) = (5, 3);
        let number = |seed: usize| ((seed * seed * 37 + 11) as f64).sin();
        let matrix = |seed: usize| DMatrix::from_fn(4, m, |r, c| number(seed + 7 * r + 31 * c));
        let vector = |seed: usize| DVector::from_fn(4, |r, _| number(seed + 13 * r));
        let mut chain = Chain::new(links, m);
        let mut whole = DMatrix::zeros(links * m, links * m);
        let mut right = DVector::zeros(links * m);
        for link in 0..links {
            let (columns, residual) = (matrix(link), vector(link));
            chain.add(link, &columns, &residual);
            let mut wide = DMatrix::zeros(4, links * m);
            wide.view_mut((0, link * m), (4, m)).copy_from(&columns);
            if link + 1 < links {
                let (next, residual) = (matrix(100 + link), vector(200 + link));
                chain.tie(link, &columns, &next, &residual);
                let mut tie = wide.clone();
                tie.view_mut((0, (link + 1) * m), (4, m)).copy_from(&next);
                whole += tie.tr_mul(&tie);
                right += tie.tr_mul(&residual);
            }
            whole += wide.tr_mul(&wide);
            right += wide.tr_mul(&residual);
        }
        let solved = chain.solve().unwrap();
        let factor = whole.clone().cholesky().unwrap();
        let (expected, covariance) = (factor.solve(&right), factor.inverse());
        for link in 0..links {
            let part = expected.rows(link * m, m);
            assert!((&solved.unknowns[link] - part).norm() < 1e-9);
            let block = covariance.view((link * m, link * m), (m, m));
            assert!((&solved.covariances[link] - block).norm() < 1e-9);
        }
        assert!((solved.log_determinant - whole.determinant().ln()).abs() < 1e-9);
    }
}
