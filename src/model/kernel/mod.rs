//! Dense products and activations, shared by training and by the single-step engine.
//!
//! C [m,n] += A [m,k] B [k,n], with B packed once in panels of [`PANEL`] columns. Each element of C is
//! one chain of fused multiply-adds over k, in order, whatever the vector width, the number of rows
//! or the blocking: the same numbers on every machine with FMA, for one row and for many.
//!
//! Blocking after K. Goto and R. van de Geijn, "Anatomy of High-Performance Matrix Multiplication",
//! ACM TOMS 34(3), 2008.

mod activation;
mod half;
mod panels;
mod product;
mod row;

use std::{
    fmt::Debug,
    iter::Sum,
    ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign},
};

use pulp::Arch;

#[cfg(test)]
pub(crate) use self::half::rounded;
pub(crate) use self::{
    activation::softmax,
    half::{BeyondHalf, HalfPanels},
    panels::{Panels, pack_rows},
};
use self::{
    activation::{Silu, SiluBackward},
    panels::{PANEL, ROWS},
    product::Product,
    row::RowProduct,
};

/// f32 for work, f64 to check gradients against finite differences.
pub(crate) trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Sum
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + candle_core::WithDType
{
    /// From a constant.
    fn real(value: f64) -> Self;
    /// e^x.
    fn exponential(self) -> Self;
    /// C [m,n] += A B with A packed by [`pack_rows`].
    fn multiply(c: &mut [Self], rows: usize, a: &[Self], b: &Panels<Self>);
    /// x -> x / (1 + e^-x), in place.
    fn silu(values: &mut [Self]);
    /// z -> gradient * d silu(z)/dz, in place of z.
    fn silu_backward(z: &mut [Self], gradient: &[Self]);
}

/// y += B^T x: one row, no packing, no allocation, in the instructions of `arch`.
pub(crate) fn multiply_row(arch: Arch, y: &mut [f32], x: &[f32], b: &Panels<f32>) {
    debug_assert_eq!((x.len(), y.len()), (b.depth, b.columns));
    arch.dispatch(RowProduct { y, x, b });
}

/// [`multiply_row`] with weights in halves: bit for bit what it gives for the same numbers in f32.
pub(crate) fn multiply_row_half(arch: Arch, y: &mut [f32], x: &[f32], b: &HalfPanels) {
    debug_assert_eq!((x.len(), y.len()), (b.depth, b.columns));
    half::multiply_row(arch, y, x, b);
}

/// a . b with eight independent sums.
pub(crate) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let mut sums = [T::default(); 8];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    for (a, b) in a.iter().zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += *a * *b;
        }
    }
    let rest: T = a_rest.iter().zip(b_rest).map(|(a, b)| *a * *b).sum();
    sums.into_iter().sum::<T>() + rest
}

/// x -> silu(x) in place.
pub(crate) fn silu(arch: Arch, values: &mut [f32]) {
    arch.dispatch(Silu(values));
}

impl Real for f32 {
    fn real(value: f64) -> Self {
        value as f32
    }

    fn exponential(self) -> Self {
        self.exp()
    }

    fn multiply(c: &mut [Self], rows: usize, a: &[Self], b: &Panels<Self>) {
        Arch::new().dispatch(Product { c, rows, a, b });
    }

    fn silu(values: &mut [Self]) {
        Arch::new().dispatch(Silu(values));
    }

    fn silu_backward(z: &mut [Self], gradient: &[Self]) {
        Arch::new().dispatch(SiluBackward(z, gradient));
    }
}

impl Real for f64 {
    fn real(value: f64) -> Self {
        value
    }

    fn exponential(self) -> Self {
        self.exp()
    }

    fn multiply(c: &mut [Self], rows: usize, a: &[Self], b: &Panels<Self>) {
        let n = b.columns;
        for row in 0..rows {
            let block = &a[row / ROWS * ROWS * b.depth..][..ROWS * b.depth];
            for column in 0..n {
                let panel = b.panel(column / PANEL);
                let sum: Self = block
                    .chunks_exact(ROWS)
                    .zip(panel)
                    .map(|(x, w)| x[row % ROWS] * w[column % PANEL])
                    .sum();
                c[row * n + column] += sum;
            }
        }
    }

    fn silu(values: &mut [Self]) {
        for value in values {
            *value /= 1.0 + (-*value).exp();
        }
    }

    fn silu_backward(z: &mut [Self], gradient: &[Self]) {
        for (z, gradient) in z.iter_mut().zip(gradient) {
            let gate = 1.0 / (1.0 + (-*z).exp());
            *z = gradient * gate * (1.0 + *z * (1.0 - gate));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in (-1, 1) without a generator.
    fn ramp(len: usize, step: f32) -> Vec<f32> {
        (0..len).map(|i| (i as f32 * step).sin()).collect()
    }

    #[test]
    fn products_agree_with_the_definition_and_between_one_row_and_many() {
        for (m, k, n) in [(1, 1, 1), (5, 7, 3), (16, 300, 70), (9, 34, 136)] {
            let (a, w) = (ramp(m * k, 0.7), ramp(n * k, 1.3));
            let b = Panels::transposed(&w, k, n);
            let mut packed = Vec::new();
            pack_rows(&mut packed, &a, (m, k), (k, 1));
            let mut c = ramp(m * n, 0.1);
            let start = c.clone();
            f32::multiply(&mut c, m, &packed, &b);
            for row in 0..m {
                let mut y = start[row * n..][..n].to_vec();
                multiply_row(Arch::new(), &mut y, &a[row * k..][..k], &b);
                assert_eq!(y, c[row * n..][..n], "row {row} of {m}x{k}x{n}");
                for (column, got) in y.iter().enumerate() {
                    let exact: f64 = (0..k)
                        .map(|i| f64::from(a[row * k + i]) * f64::from(w[column * k + i]))
                        .sum::<f64>()
                        + f64::from(start[row * n + column]);
                    assert!(
                        (f64::from(*got) - exact).abs() < 1e-4,
                        "{got} against {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn transposed_rows_give_the_product_of_the_transpose() {
        let (m, k, n) = (6, 10, 33);
        let (a, b) = (ramp(k * m, 0.3), ramp(k * n, 0.9));
        let mut packed = Vec::new();
        pack_rows(&mut packed, &a, (m, k), (1, m));
        let mut c = vec![0.0; m * n];
        f32::multiply(&mut c, m, &packed, &Panels::new(&b, k, n));
        for row in 0..m {
            for column in 0..n {
                let exact: f32 = (0..k).map(|i| a[i * m + row] * b[i * n + column]).sum();
                assert!((c[row * n + column] - exact).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn silu_and_its_derivative_are_exact_to_single_precision() {
        let x: Vec<f32> = (-2000..=2000)
            .map(|i| i as f32 * 0.0517)
            .chain([0.0, 1e30, -1e30, f32::MAX])
            .collect();
        let mut y = x.clone();
        silu(Arch::new(), &mut y);
        let mut slope = x.clone();
        f32::silu_backward(&mut slope, &vec![1.0; x.len()]);
        for ((x, y), slope) in x.iter().zip(&y).zip(&slope) {
            let x = f64::from(*x);
            let gate = 1.0 / (1.0 + (-x).exp());
            assert!(
                (f64::from(*y) - x * gate).abs() <= 3e-7 * x.abs().max(1e-20),
                "silu({x}) = {y}"
            );
            if x.abs() < 100.0 {
                let exact = gate * (1.0 + x * (1.0 - gate));
                assert!(
                    (f64::from(*slope) - exact).abs() < 1e-6,
                    "slope({x}) = {slope}, not {exact}"
                );
            }
        }
    }
}
