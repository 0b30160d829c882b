//! Arithmetic in f32 and in f64 behind one trait.

use std::{
    fmt::Debug,
    iter::Sum,
    ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign},
};

use pulp::Arch;

use super::{
    activation::{SiluBackward, sigmoid, silu},
    panels::{PANEL, Panels, ROWS},
    rows::multiply_rows,
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
    /// x -> 1 / (1 + e^-x), in place.
    fn sigmoid(values: &mut [Self]);
    /// z -> gradient * d silu(z)/dz, in place of z.
    fn silu_backward(z: &mut [Self], gradient: &[Self]);
}

/// The sum [len] of what the parts of a batch give, added in their order: the same whatever the number of threads.
pub(crate) fn sum_in_order<T: Real>(parts: Vec<Vec<T>>, len: usize) -> Vec<T> {
    let mut total = vec![T::default(); len];
    for part in parts {
        for (sum, value) in total.iter_mut().zip(part) {
            *sum += value;
        }
    }
    total
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

impl Real for f32 {
    fn real(value: f64) -> Self {
        value as f32
    }

    fn exponential(self) -> Self {
        self.exp()
    }

    fn multiply(c: &mut [Self], rows: usize, a: &[Self], b: &Panels<Self>) {
        multiply_rows(Arch::new(), c, rows, a, b);
    }

    fn silu(values: &mut [Self]) {
        silu(Arch::new(), values);
    }

    fn sigmoid(values: &mut [Self]) {
        sigmoid(Arch::new(), values);
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

    fn sigmoid(values: &mut [Self]) {
        for value in values {
            *value = 1.0 / (1.0 + (-*value).exp());
        }
    }

    fn silu_backward(z: &mut [Self], gradient: &[Self]) {
        for (z, gradient) in z.iter_mut().zip(gradient) {
            let gate = 1.0 / (1.0 + (-*z).exp());
            *z = gradient * gate * (1.0 + *z * (1.0 - gate));
        }
    }
}
