//! Dense products and the SiLU activation, shared by training and by the single-step engine.
//!
//! C [m,n] += A [m,k] B [k,n], with B packed once in panels of [`PANEL`] columns. Each element of C is
//! one chain of fused multiply-adds over k, in order, whatever the vector width, the number of rows
//! or the blocking: the same numbers on every machine with FMA, for one row and for many.
//!
//! Blocking after K. Goto and R. van de Geijn, "Anatomy of High-Performance Matrix Multiplication",
//! ACM TOMS 34(3), 2008.

use std::{
    fmt::Debug,
    iter::Sum,
    ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign},
};

use pulp::{Arch, Simd, WithSimd};

/// Columns of B that lie together.
pub(crate) const PANEL: usize = 32;
/// Rows of A that are multiplied together.
const ROWS: usize = 4;
/// Depth of a block: one panel's block stays in the first-level cache (256 x 32 x 4 bytes).
const DEPTH: usize = 256;

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

/// B [k,n], packed: [ceil(n / PANEL)][k][PANEL], padded with zeros.
#[derive(Clone, Debug, Default)]
pub(crate) struct Panels<T> {
    depth: usize,
    columns: usize,
    data: Vec<[T; PANEL]>,
}

impl<T: Real> Panels<T> {
    /// B itself, row-major [k,n].
    pub(crate) fn new(data: &[T], depth: usize, columns: usize) -> Self {
        let mut panels = Self::default();
        panels.pack(data, depth, columns, columns);
        panels
    }

    /// B = W^T of a row-major W [n,k], as a layer's weight is stored.
    pub(crate) fn transposed(weight: &[T], depth: usize, columns: usize) -> Self {
        let mut data = vec![[T::default(); PANEL]; depth * columns.div_ceil(PANEL)];
        for (column, row) in weight.chunks_exact(depth).enumerate() {
            let panel = &mut data[column / PANEL * depth..][..depth];
            for (slot, value) in panel.iter_mut().zip(row) {
                slot[column % PANEL] = *value;
            }
        }
        Self {
            depth,
            columns,
            data,
        }
    }

    /// Packs the first `columns` of each of `depth` rows of length `stride`, reusing memory.
    pub(crate) fn pack(&mut self, data: &[T], depth: usize, columns: usize, stride: usize) {
        self.depth = depth;
        self.columns = columns;
        self.data.clear();
        self.data
            .resize(depth * columns.div_ceil(PANEL), [T::default(); PANEL]);
        for (row, values) in data.chunks(stride).take(depth).enumerate() {
            for (panel, part) in values[..columns].chunks(PANEL).enumerate() {
                self.data[panel * depth + row][..part.len()].copy_from_slice(part);
            }
        }
    }

    /// n.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    fn panel(&self, index: usize) -> &[[T; PANEL]] {
        &self.data[index * self.depth..][..self.depth]
    }
}

/// Packs A [rows,k] as [ceil(rows / ROWS)][k][ROWS]; element (r, k) lies at `r * row_stride + k * depth_stride`.
pub(crate) fn pack_rows<T: Real>(
    packed: &mut Vec<T>,
    a: &[T],
    (rows, depth): (usize, usize),
    (row_stride, depth_stride): (usize, usize),
) {
    packed.clear();
    packed.resize(rows.div_ceil(ROWS) * ROWS * depth, T::default());
    for (block, group) in packed.chunks_exact_mut(ROWS * depth).enumerate() {
        let first = block * ROWS;
        let height = ROWS.min(rows - first);
        if depth_stride == 1 {
            for r in 0..height {
                let row = &a[(first + r) * row_stride..][..depth];
                for (slot, value) in group.chunks_exact_mut(ROWS).zip(row) {
                    slot[r] = *value;
                }
            }
        } else {
            for (k, slot) in group.chunks_exact_mut(ROWS).enumerate() {
                for (r, value) in slot[..height].iter_mut().enumerate() {
                    *value = a[(first + r) * row_stride + k * depth_stride];
                }
            }
        }
    }
}

/// y += B^T x: one row, no packing, no allocation.
pub(crate) fn multiply_row(y: &mut [f32], x: &[f32], b: &Panels<f32>) {
    debug_assert_eq!((x.len(), y.len()), (b.depth, b.columns));
    Arch::new().dispatch(RowProduct { y, x, b });
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
pub(crate) fn silu(values: &mut [f32]) {
    f32::silu(values);
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

/// `tile` += A's rows [k][M] times one panel's rows [k][PANEL].
#[inline(always)]
fn accumulate<S: Simd, const M: usize>(
    simd: S,
    a: &[[f32; M]],
    panel: &[[f32; PANEL]],
    tile: &mut [[f32; PANEL]; M],
) {
    // Two vectors of columns at a time: 2 M independent chains hide the latency of the multiply-add.
    for pair in 0..PANEL / (2 * S::F32_LANES) {
        let (left, right) = (2 * pair, 2 * pair + 1);
        let mut sums = [[simd.splat_f32s(0.0); 2]; M];
        for (sum, row) in sums.iter_mut().zip(tile.iter()) {
            let (row, _) = S::as_simd_f32s(row);
            *sum = [row[left], row[right]];
        }
        for (a, w) in a.iter().zip(panel) {
            let (w, _) = S::as_simd_f32s(w);
            let (w_left, w_right) = (w[left], w[right]);
            for (sum, a) in sums.iter_mut().zip(a) {
                let a = simd.splat_f32s(*a);
                sum[0] = simd.mul_add_f32s(a, w_left, sum[0]);
                sum[1] = simd.mul_add_f32s(a, w_right, sum[1]);
            }
        }
        for (sum, row) in sums.iter().zip(tile.iter_mut()) {
            let (row, _) = S::as_mut_simd_f32s(row);
            row[left] = sum[0];
            row[right] = sum[1];
        }
    }
}

struct Product<'a> {
    c: &'a mut [f32],
    rows: usize,
    a: &'a [f32],
    b: &'a Panels<f32>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { c, rows, a, b } = self;
        let n = b.columns;
        let (a, _) = a.as_chunks::<ROWS>();
        for (index, columns) in (0..n).step_by(PANEL).enumerate() {
            let width = PANEL.min(n - columns);
            let panel = b.panel(index);
            for depth in (0..b.depth).step_by(DEPTH) {
                let end = b.depth.min(depth + DEPTH);
                for (block, first) in (0..rows).step_by(ROWS).enumerate() {
                    let height = ROWS.min(rows - first);
                    let mut tile = [[0.0; PANEL]; ROWS];
                    for (r, row) in tile[..height].iter_mut().enumerate() {
                        row[..width].copy_from_slice(&c[(first + r) * n + columns..][..width]);
                    }
                    accumulate(
                        simd,
                        &a[block * b.depth..][depth..end],
                        &panel[depth..end],
                        &mut tile,
                    );
                    for (r, row) in tile[..height].iter().enumerate() {
                        c[(first + r) * n + columns..][..width].copy_from_slice(&row[..width]);
                    }
                }
            }
        }
    }
}

struct RowProduct<'a> {
    y: &'a mut [f32],
    x: &'a [f32],
    b: &'a Panels<f32>,
}

impl RowProduct<'_> {
    /// `G` panels side by side, so that one row alone has enough independent chains.
    #[inline(always)]
    fn panels<S: Simd, const G: usize>(
        simd: S,
        y: &mut [f32],
        x: &[f32],
        panels: [&[[f32; PANEL]]; G],
    ) {
        let panels = panels.map(|panel| &panel[..x.len()]);
        for pair in 0..PANEL / (2 * S::F32_LANES) {
            let (left, right) = (2 * pair, 2 * pair + 1);
            let mut tile = [[0.0; PANEL]; G];
            for (row, y) in tile.iter_mut().zip(y.chunks(PANEL)) {
                row[..y.len()].copy_from_slice(y);
            }
            let mut sums = [[simd.splat_f32s(0.0); 2]; G];
            for (sum, row) in sums.iter_mut().zip(&tile) {
                let (row, _) = S::as_simd_f32s(row);
                *sum = [row[left], row[right]];
            }
            for (k, x) in x.iter().enumerate() {
                let x = simd.splat_f32s(*x);
                for (sum, panel) in sums.iter_mut().zip(&panels) {
                    let (w, _) = S::as_simd_f32s(&panel[k]);
                    sum[0] = simd.mul_add_f32s(x, w[left], sum[0]);
                    sum[1] = simd.mul_add_f32s(x, w[right], sum[1]);
                }
            }
            let columns = 2 * pair * S::F32_LANES..2 * (pair + 1) * S::F32_LANES;
            for ((sum, row), y) in sums.iter().zip(tile.iter_mut()).zip(y.chunks_mut(PANEL)) {
                let (vectors, _) = S::as_mut_simd_f32s(row);
                vectors[left] = sum[0];
                vectors[right] = sum[1];
                let end = columns.end.min(y.len());
                let start = columns.start.min(end);
                y[start..end].copy_from_slice(&row[start..end]);
            }
        }
    }
}

impl WithSimd for RowProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        const GROUP: usize = 4;
        let Self { y, x, b } = self;
        let mut index = 0;
        for part in y.chunks_mut(GROUP * PANEL) {
            if part.len() > (GROUP - 1) * PANEL {
                Self::panels(simd, part, x, [0, 1, 2, 3].map(|i| b.panel(index + i)));
            } else {
                for (i, part) in part.chunks_mut(PANEL).enumerate() {
                    Self::panels(simd, part, x, [b.panel(index + i)]);
                }
            }
            index += GROUP;
        }
    }
}

/// 1 / (1 + e^-x): e^-x = 2^n e^r with |r| <= ln 2 / 2, the polynomial of Cephes' `expf`
/// (S. Moshier, "Methods and Programs for Mathematical Functions", 1989); relative error about 1e-7.
#[inline(always)]
fn gate<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    // 1.5 * 2^23: adding it rounds to the nearest integer, which then lies in the low bits.
    const MAGIC: f32 = 12_582_912.0;
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    const POLYNOMIAL: [f32; 6] = [
        1.987_569_1e-4,
        1.398_199_9e-3,
        8.333_452e-3,
        4.166_579_6e-2,
        1.666_666_5e-1,
        0.5,
    ];
    // Beyond 87 the exponential leaves the range of f32; the gate is then 0 or 1 anyway.
    let t = simd.min_f32s(
        simd.max_f32s(simd.neg_f32s(x), simd.splat_f32s(-87.0)),
        simd.splat_f32s(87.0),
    );
    let shifted = simd.mul_add_f32s(
        t,
        simd.splat_f32s(std::f32::consts::LOG2_E),
        simd.splat_f32s(MAGIC),
    );
    let n = simd.sub_f32s(shifted, simd.splat_f32s(MAGIC));
    let r = simd.negate_mul_add_f32s(n, simd.splat_f32s(LN2_HIGH), t);
    let r = simd.negate_mul_add_f32s(n, simd.splat_f32s(LN2_LOW), r);
    let mut p = simd.splat_f32s(POLYNOMIAL[0]);
    for coefficient in &POLYNOMIAL[1..] {
        p = simd.mul_add_f32s(p, r, simd.splat_f32s(*coefficient));
    }
    let p = simd.add_f32s(
        simd.mul_add_f32s(simd.mul_f32s(r, r), p, r),
        simd.splat_f32s(1.0),
    );
    // 2^n: n + 127 into the exponent; the bits of MAGIC fall off at the top.
    let exponent = simd.add_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(127));
    let power = simd.transmute_f32s_u32s(simd.wrapping_dyn_shl_u32s(exponent, simd.splat_u32s(23)));
    simd.div_f32s(
        simd.splat_f32s(1.0),
        simd.mul_add_f32s(p, power, simd.splat_f32s(1.0)),
    )
}

/// gradient * d silu(z)/dz. A function, not a closure: only what is inlined here is compiled for the vector unit.
#[inline(always)]
fn slope<S: Simd>(simd: S, z: S::f32s, gradient: S::f32s) -> S::f32s {
    let one = simd.splat_f32s(1.0);
    let gate = gate(simd, z);
    let slope = simd.mul_add_f32s(z, simd.sub_f32s(one, gate), one);
    simd.mul_f32s(gradient, simd.mul_f32s(gate, slope))
}

struct Silu<'a>(&'a mut [f32]);

impl WithSimd for Silu<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (vectors, rest) = S::as_mut_simd_f32s(self.0);
        for x in vectors {
            *x = simd.mul_f32s(*x, gate(simd, *x));
        }
        if !rest.is_empty() {
            let x = simd.partial_load_f32s(rest);
            simd.partial_store_f32s(rest, simd.mul_f32s(x, gate(simd, x)));
        }
    }
}

struct SiluBackward<'a>(&'a mut [f32], &'a [f32]);

impl WithSimd for SiluBackward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (z, z_rest) = S::as_mut_simd_f32s(self.0);
        let (gradient, gradient_rest) = S::as_simd_f32s(self.1);
        for (z, gradient) in z.iter_mut().zip(gradient) {
            *z = slope(simd, *z, *gradient);
        }
        if !z_rest.is_empty() {
            let values = slope(
                simd,
                simd.partial_load_f32s(z_rest),
                simd.partial_load_f32s(gradient_rest),
            );
            simd.partial_store_f32s(z_rest, values);
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
                multiply_row(&mut y, &a[row * k..][..k], &b);
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
        silu(&mut y);
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
