//! One row: y += B^T x, where reading B is what takes time.

use pulp::{Arch, Simd, WithSimd};

use super::panels::{PANEL, Panels};

/// y += B^T x: one row, no packing, no allocation, in the instructions of `arch`.
pub(crate) fn multiply_row(arch: Arch, y: &mut [f32], x: &[f32], b: &Panels<f32>) {
    debug_assert_eq!((x.len(), y.len()), (b.depth, b.columns));
    arch.dispatch(RowProduct { y, x, b });
}

/// y [n] += B^T x [k].
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
                    sum[0] = simd.mul_add_e_f32s(x, w[left], sum[0]);
                    sum[1] = simd.mul_add_e_f32s(x, w[right], sum[1]);
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
