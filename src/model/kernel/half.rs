//! One row with weights in IEEE halves: half the bytes to read, f32 arithmetic.
//!
//! A half's sign, exponent and fraction, moved to their places in an f32, give the half's value times 2^-112: two
//! shifts and two masks, in any vector unit that knows 32-bit integers. That power of two is taken back where it costs
//! nothing, half of it from x and half from the sum, so that neither leaves the range of f32; powers of two do not
//! round, hence the sums are those of [`super::row`] for the same weights, bit for bit.

use half::f16;
use pulp::{Simd, WithSimd};
use thiserror::Error;

use super::panels::{PANEL, Panels};

/// Words of a panel's row: each holds two columns.
const WORDS: usize = PANEL / 2;
/// Sign of an f32.
const SIGN: u32 = 0x8000_0000;
/// Where exponent and fraction of a half stand once moved.
const MAGNITUDE: u32 = 0x0fff_e000;
/// 2^56: twice this power is the f32's bias less the half's.
const ROOT: f32 = (1u64 << 56) as f32;

/// B [k,n] in halves: [ceil(n / PANEL)][k][WORDS], column j of a panel in the low and column j + WORDS in the high
/// half of word j.
#[derive(Clone, Debug, Default)]
pub(crate) struct HalfPanels {
    pub(super) depth: usize,
    pub(super) columns: usize,
    data: Vec<[u32; WORDS]>,
}

/// A weight that no half can hold.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("a weight is {0}; halves reach to 65504")]
pub(crate) struct BeyondHalf(pub(crate) f32);

/// The nearest half that is zero or normal: subnormal ones would be denormal once moved, which some processors
/// compute slowly. The error is at most 2^-11 of the number, or 2^-15 where it is smaller than 2^-14.
pub(crate) fn rounded(value: f32) -> Result<f16, BeyondHalf> {
    let half = f16::from_f32(value);
    if !half.is_finite() {
        return Err(BeyondHalf(value));
    }
    let least = f16::MIN_POSITIVE.to_f32();
    Ok(if value.abs() >= least {
        half
    } else if value.abs() >= least / 2.0 {
        f16::from_f32(least.copysign(value))
    } else {
        f16::ZERO
    })
}

impl HalfPanels {
    /// Rounds every weight to a half.
    pub(crate) fn new(panels: &Panels<f32>) -> Result<Self, BeyondHalf> {
        let word = |row: &[f32; PANEL], at: usize| {
            let (low, high) = (rounded(row[at])?, rounded(row[at + WORDS])?);
            Ok(u32::from(high.to_bits()) << 16 | u32::from(low.to_bits()))
        };
        let data = panels
            .rows()
            .map(|row| {
                let mut words = [0; WORDS];
                for (at, slot) in words.iter_mut().enumerate() {
                    *slot = word(row, at)?;
                }
                Ok(words)
            })
            .collect::<Result<_, BeyondHalf>>()?;
        Ok(Self {
            depth: panels.depth,
            columns: panels.columns,
            data,
        })
    }

    /// The same weights in f32.
    pub(crate) fn widened(&self) -> Panels<f32> {
        let rows = self.data.iter().map(|words| {
            let mut row = [0.0; PANEL];
            for (at, word) in words.iter().enumerate() {
                row[at] = f16::from_bits(*word as u16).to_f32();
                row[at + WORDS] = f16::from_bits((*word >> 16) as u16).to_f32();
            }
            row
        });
        Panels::from_rows(self.depth, self.columns, rows.collect())
    }

    /// n.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    fn panel(&self, index: usize) -> &[[u32; WORDS]] {
        &self.data[index * self.depth..][..self.depth]
    }
}

/// y [n] += B^T x [k].
pub(super) struct HalfRowProduct<'a> {
    pub(super) y: &'a mut [f32],
    pub(super) x: &'a [f32],
    pub(super) b: &'a HalfPanels,
}

impl HalfRowProduct<'_> {
    /// `G` panels side by side, so that one row alone has enough independent chains.
    #[inline(always)]
    fn panels<S: Simd, const G: usize>(
        simd: S,
        y: &mut [f32],
        x: &[f32],
        panels: [&[[u32; WORDS]]; G],
    ) {
        let panels = panels.map(|panel| &panel[..x.len()]);
        let (root, inverse) = (simd.splat_f32s(ROOT), simd.splat_f32s(1.0 / ROOT));
        let (sign, magnitude) = (simd.splat_u32s(SIGN), simd.splat_u32s(MAGNITUDE));
        let shift = |by: u32| simd.splat_u32s(by);
        let (by_3, by_13, by_16) = (shift(3), shift(13), shift(16));
        let vectors = WORDS / S::U32_LANES;
        for low in 0..vectors {
            let high = low + vectors;
            let mut tile = [[0.0; PANEL]; G];
            for (row, y) in tile.iter_mut().zip(y.chunks(PANEL)) {
                row[..y.len()].copy_from_slice(y);
            }
            let mut sums = [[inverse; 2]; G];
            for (sum, row) in sums.iter_mut().zip(&tile) {
                let (row, _) = S::as_simd_f32s(row);
                *sum = [
                    simd.mul_f32s(row[low], inverse),
                    simd.mul_f32s(row[high], inverse),
                ];
            }
            for (k, x) in x.iter().enumerate() {
                let x = simd.mul_f32s(simd.splat_f32s(*x), root);
                for (sum, panel) in sums.iter_mut().zip(&panels) {
                    let (words, _) = S::as_simd_u32s(&panel[k]);
                    let word = words[low];
                    let moved = |value, sign_from| {
                        simd.transmute_f32s_u32s(simd.or_u32s(
                            simd.and_u32s(value, magnitude),
                            simd.and_u32s(sign_from, sign),
                        ))
                    };
                    let left = moved(
                        simd.wrapping_dyn_shl_u32s(word, by_13),
                        simd.wrapping_dyn_shl_u32s(word, by_16),
                    );
                    let right = moved(simd.wrapping_dyn_shr_u32s(word, by_3), word);
                    sum[0] = simd.mul_add_e_f32s(x, left, sum[0]);
                    sum[1] = simd.mul_add_e_f32s(x, right, sum[1]);
                }
            }
            for ((sum, row), y) in sums.iter().zip(tile.iter_mut()).zip(y.chunks_mut(PANEL)) {
                let (vectors, _) = S::as_mut_simd_f32s(row);
                vectors[low] = simd.mul_f32s(sum[0], root);
                vectors[high] = simd.mul_f32s(sum[1], root);
                for vector in [low, high] {
                    let end = ((vector + 1) * S::F32_LANES).min(y.len());
                    let start = (vector * S::F32_LANES).min(end);
                    y[start..end].copy_from_slice(&row[start..end]);
                }
            }
        }
    }
}

impl WithSimd for HalfRowProduct<'_> {
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
