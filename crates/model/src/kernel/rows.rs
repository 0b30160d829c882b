//! Many rows: C [m,n] += A B.

use pulp::{Arch, Simd, WithSimd};

use super::panels::{PANEL, Panels, ROWS};

/// Depth of a block: one panel's block stays in the first-level cache (256 x 32 x 4 bytes).
const DEPTH: usize = 256;
/// Vector registers below which a full group of rows would spill.
const MANY_REGISTERS: usize = 32;

/// `tile` += A's rows `FIRST` to `FIRST + M` [k][ROWS] times one panel's rows [k][PANEL].
#[inline(always)]
fn accumulate<S: Simd, const FIRST: usize, const M: usize>(
    simd: S,
    a: &[[f32; ROWS]],
    panel: &[[f32; PANEL]],
    tile: &mut [[f32; PANEL]; ROWS],
) {
    // Two vectors of columns at a time: 2 M independent chains hide the latency of the multiply-add.
    for pair in 0..PANEL / (2 * S::F32_LANES) {
        let (left, right) = (2 * pair, 2 * pair + 1);
        let mut sums = [[simd.splat_f32s(0.0); 2]; M];
        for (sum, row) in sums.iter_mut().zip(&tile[FIRST..]) {
            let (row, _) = S::as_simd_f32s(row);
            *sum = [row[left], row[right]];
        }
        for (a, w) in a.iter().zip(panel) {
            let (w, _) = S::as_simd_f32s(w);
            let (w_left, w_right) = (w[left], w[right]);
            for (sum, a) in sums.iter_mut().zip(&a[FIRST..]) {
                let a = simd.splat_f32s(*a);
                sum[0] = simd.mul_add_e_f32s(a, w_left, sum[0]);
                sum[1] = simd.mul_add_e_f32s(a, w_right, sum[1]);
            }
        }
        for (sum, row) in sums.iter().zip(&mut tile[FIRST..]) {
            let (row, _) = S::as_mut_simd_f32s(row);
            row[left] = sum[0];
            row[right] = sum[1];
        }
    }
}

/// C [rows,n] += A B with A packed by [`super::pack_rows`], in the instructions of `arch`.
pub(crate) fn multiply_rows(arch: Arch, c: &mut [f32], rows: usize, a: &[f32], b: &Panels<f32>) {
    arch.dispatch(Product { c, rows, a, b });
}

/// C [rows, n] += A B, A packed by [`super::pack_rows`].
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
        const HALF: usize = ROWS / 2;
        let Self { c, rows, a, b } = self;
        let n = b.columns;
        let (a, _) = a.as_chunks::<ROWS>();
        for (index, columns) in (0..n).step_by(PANEL).enumerate() {
            let width = PANEL.min(n - columns);
            let panel = b.panel(index);
            for depth in (0..b.depth).step_by(DEPTH) {
                let end = b.depth.min(depth + DEPTH);
                let panel = &panel[depth..end];
                for (block, first) in (0..rows).step_by(ROWS).enumerate() {
                    let height = ROWS.min(rows - first);
                    let group = &a[block * b.depth..][depth..end];
                    let mut tile = [[0.0; PANEL]; ROWS];
                    for (r, row) in tile[..height].iter_mut().enumerate() {
                        row[..width].copy_from_slice(&c[(first + r) * n + columns..][..width]);
                    }
                    if height > HALF && S::REGISTER_COUNT >= MANY_REGISTERS {
                        accumulate::<S, 0, ROWS>(simd, group, panel, &mut tile);
                    } else {
                        accumulate::<S, 0, HALF>(simd, group, panel, &mut tile);
                        if height > HALF {
                            accumulate::<S, HALF, HALF>(simd, group, panel, &mut tile);
                        }
                    }
                    for (r, row) in tile[..height].iter().enumerate() {
                        c[(first + r) * n + columns..][..width].copy_from_slice(&row[..width]);
                    }
                }
            }
        }
    }
}
