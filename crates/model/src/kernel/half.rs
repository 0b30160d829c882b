//! One row with weights in IEEE halves: half the bytes to read, f32 arithmetic.
//!
//! AVX-512 widens halves by an instruction of its own. Elsewhere a half's sign, exponent and fraction, moved to their
//! places in an f32, give the half's value times 2^-112: shifts and masks, in any vector unit that knows 32-bit
//! integers. That power of two is taken back where it costs nothing, half of it from x and half from the sum. Powers of
//! two do not round, hence either way the sums are those of [`super::row`] for the same weights, bit for bit, as long as
//! |x| stays below 2^71 and sums are not below 2^-70 in size; beyond, the second way overflows to infinity, or loses
//! digits of what is next to nothing.

use half::f16;
use pulp::{Arch, Simd, WithSimd};
#[cfg(target_arch = "x86_64")]
use pulp::{bytemuck::cast, x86::V4};
use thiserror::Error;

use super::panels::{PANEL, Panels};

/// Words of a panel's row: each holds two columns.
const WORDS: usize = PANEL / 2;
/// Sign of an f32.
const SIGN: u32 = 0x8000_0000;
/// Bits of exponent and fraction of a half after the shift.
const MAGNITUDE: u32 = 0x0fff_e000;
/// 2^56: twice this power is the f32's bias less the half's.
const ROOT: f32 = (1u64 << 56) as f32;

/// B [k,n] in halves: [ceil(n / PANEL)][k][WORDS], columns 2 j and 2 j + 1 of a panel in the low and the high half of
/// word j.
#[derive(Clone, Debug, Default)]
pub(crate) struct HalfPanels {
    depth: usize,
    columns: usize,
    data: Vec<[u32; WORDS]>,
}

/// A weight that no half can hold.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("a weight is {0}, halves reach to 65504")]
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
            let (low, high) = (rounded(row[2 * at])?, rounded(row[2 * at + 1])?);
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
                row[2 * at] = f16::from_bits(*word as u16).to_f32();
                row[2 * at + 1] = f16::from_bits((*word >> 16) as u16).to_f32();
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

/// Conversion of packed halves to vectors of f32.
trait Widen: Copy {
    type Vector: Simd;
    /// The power of two that x and the sums are multiplied by.
    const ROOT: f32;

    fn simd(self) -> Self::Vector;

    /// Two vectors' worth of a panel's row, the `pair`-th, over ROOT squared.
    fn widen(self, words: &[u32; WORDS], pair: usize) -> [<Self::Vector as Simd>::f32s; 2];

    /// The column that stands at `lane` of the first or second vector of a pair.
    fn column(pair: usize, second: bool, lane: usize) -> usize;
}

/// Conversion by shifts and masks: even columns first, then odd ones.
#[derive(Clone, Copy)]
struct ByShifts<S>(S);

impl<S: Simd> Widen for ByShifts<S> {
    type Vector = S;
    const ROOT: f32 = ROOT;

    #[inline(always)]
    fn simd(self) -> S {
        self.0
    }

    #[inline(always)]
    fn widen(self, words: &[u32; WORDS], pair: usize) -> [S::f32s; 2] {
        let simd = self.0;
        let (words, _) = S::as_simd_u32s(words);
        let word = words[pair];
        let shift = |by: u32| simd.splat_u32s(by);
        let (sign, magnitude) = (simd.splat_u32s(SIGN), simd.splat_u32s(MAGNITUDE));
        let moved = |value, sign_from| {
            let value = simd.and_u32s(value, magnitude);
            simd.transmute_f32s_u32s(simd.or_u32s(value, simd.and_u32s(sign_from, sign)))
        };
        let low = moved(
            simd.wrapping_dyn_shl_u32s(word, shift(13)),
            simd.wrapping_dyn_shl_u32s(word, shift(16)),
        );
        [low, moved(simd.wrapping_dyn_shr_u32s(word, shift(3)), word)]
    }

    #[inline(always)]
    fn column(pair: usize, second: bool, lane: usize) -> usize {
        2 * (pair * S::U32_LANES + lane) + usize::from(second)
    }
}

/// Conversion by the AVX-512 instruction: columns in order.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct ByConversion(V4);

#[cfg(target_arch = "x86_64")]
impl Widen for ByConversion {
    type Vector = V4;
    const ROOT: f32 = 1.0;

    #[inline(always)]
    fn simd(self) -> V4 {
        self.0
    }

    #[inline(always)]
    fn widen(self, words: &[u32; WORDS], _: usize) -> [<V4 as Simd>::f32s; 2] {
        let (halves, _) = words.as_chunks::<8>();
        let avx512 = self.0.avx512f;
        [
            cast(avx512._mm512_cvtph_ps(cast(halves[0]))),
            cast(avx512._mm512_cvtph_ps(cast(halves[1]))),
        ]
    }

    #[inline(always)]
    fn column(_: usize, second: bool, lane: usize) -> usize {
        WORDS * usize::from(second) + lane
    }
}

/// [`super::multiply_row`] with weights in halves: bit for bit what it gives for the same numbers in f32.
pub(crate) fn multiply_row_half(arch: Arch, y: &mut [f32], x: &[f32], b: &HalfPanels) {
    debug_assert_eq!((x.len(), y.len()), (b.depth, b.columns));
    match arch {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(simd, Converted { simd, y, x, b }),
        _ => arch.dispatch(Shifted { y, x, b }),
    }
}

struct Shifted<'a> {
    y: &'a mut [f32],
    x: &'a [f32],
    b: &'a HalfPanels,
}

impl WithSimd for Shifted<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        product(ByShifts(simd), self.y, self.x, self.b);
    }
}

#[cfg(target_arch = "x86_64")]
struct Converted<'a> {
    simd: V4,
    y: &'a mut [f32],
    x: &'a [f32],
    b: &'a HalfPanels,
}

#[cfg(target_arch = "x86_64")]
impl WithSimd for Converted<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        product(ByConversion(self.simd), self.y, self.x, self.b);
    }
}

#[inline(always)]
fn product<W: Widen>(widen: W, y: &mut [f32], x: &[f32], b: &HalfPanels) {
    const GROUP: usize = 4;
    let mut index = 0;
    for part in y.chunks_mut(GROUP * PANEL) {
        if part.len() > (GROUP - 1) * PANEL {
            panels(widen, part, x, [0, 1, 2, 3].map(|i| b.panel(index + i)));
        } else {
            for (i, part) in part.chunks_mut(PANEL).enumerate() {
                panels(widen, part, x, [b.panel(index + i)]);
            }
        }
        index += GROUP;
    }
}

/// `G` panels side by side, so that one row alone has enough independent chains.
#[inline(always)]
fn panels<W: Widen, const G: usize>(
    widen: W,
    y: &mut [f32],
    x: &[f32],
    panels: [&[[u32; WORDS]]; G],
) {
    let simd = widen.simd();
    let lanes = <W::Vector as Simd>::F32_LANES;
    let panels = panels.map(|panel| &panel[..x.len()]);
    for pair in 0..WORDS / lanes {
        // The sums' columns, gathered from y and put back.
        let mut tile = [[0.0; PANEL]; G];
        for (row, y) in tile.iter_mut().zip(y.chunks(PANEL)) {
            for (lane, slot) in row[..2 * lanes].iter_mut().enumerate() {
                let column = W::column(pair, lane >= lanes, lane % lanes);
                *slot = y.get(column).map_or(0.0, |y| y / W::ROOT);
            }
        }
        let mut sums = [[simd.splat_f32s(0.0); 2]; G];
        for (sum, row) in sums.iter_mut().zip(&tile) {
            let (row, _) = W::Vector::as_simd_f32s(row);
            *sum = [row[0], row[1]];
        }
        for (k, x) in x.iter().enumerate() {
            let x = simd.splat_f32s(x * W::ROOT);
            for (sum, panel) in sums.iter_mut().zip(&panels) {
                let [first, second] = widen.widen(&panel[k], pair);
                sum[0] = simd.mul_add_e_f32s(x, first, sum[0]);
                sum[1] = simd.mul_add_e_f32s(x, second, sum[1]);
            }
        }
        for ((sum, row), y) in sums.iter().zip(tile.iter_mut()).zip(y.chunks_mut(PANEL)) {
            let (vectors, _) = W::Vector::as_mut_simd_f32s(row);
            vectors[0] = sum[0];
            vectors[1] = sum[1];
            for (lane, sum) in row[..2 * lanes].iter().enumerate() {
                let column = W::column(pair, lane >= lanes, lane % lanes);
                if let Some(y) = y.get_mut(column) {
                    *y = sum * W::ROOT;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{instruction_sets, multiply_row};

    #[test]
    fn halves_are_the_nearest_ones_that_are_zero_or_normal() {
        let least = 2f32.powi(-14);
        let cases = [
            (0.0, 0.0),
            (1.0 + 2f32.powi(-12), 1.0),
            (1.0 + 3.0 * 2f32.powi(-12), 1.0 + 2f32.powi(-10)),
            (least, least),
            (0.75 * least, least),
            (-0.5 * least, -least),
            (0.49 * least, 0.0),
            (65519.0, 65504.0),
            (-65504.0, -65504.0),
        ];
        for (value, want) in cases {
            assert_eq!(rounded(value).expect("in range").to_f32(), want, "{value}");
        }
        for value in [65520.0, -1e30, f32::INFINITY] {
            assert_eq!(rounded(value), Err(BeyondHalf(value)));
        }
        assert!(rounded(f32::NAN).is_err());
    }

    /// Every half that is zero or normal, in every place of a panel.
    #[test]
    fn every_half_is_widened_as_it_is() {
        let all: Vec<f32> = (0..=u16::MAX)
            .map(f16::from_bits)
            .filter(|half| half.is_normal() || half.to_bits() == 0)
            .map(f16::to_f32)
            .collect();
        let columns = PANEL + 5;
        for arch in instruction_sets() {
            for shift in [0, 1, 17] {
                for weights in all[shift..].chunks_exact(columns) {
                    let panels = Panels::new(weights, 1, columns);
                    let halves = HalfPanels::new(&panels).expect("in range");
                    assert_eq!(halves.columns(), columns);
                    let mut y = vec![0.0; columns];
                    multiply_row_half(arch, &mut y, &[1.0], &halves);
                    assert_eq!(y, weights, "{arch:?}");
                    let mut y = vec![0.0; columns];
                    multiply_row(arch, &mut y, &[1.0], &halves.widened());
                    assert_eq!(y, weights, "{arch:?}");
                }
            }
        }
    }

    #[test]
    fn large_and_small_numbers_keep_their_digits() {
        let panels = Panels::new(&[0.5f32; 3 * 40], 3, 40);
        let halves = HalfPanels::new(&panels).expect("in range");
        for arch in instruction_sets() {
            for x in [[1e20, -3e20, 1.0], [1e-20, 3e-21, -1e-20]] {
                let (mut y, mut want) = (vec![0.0; 40], vec![0.0; 40]);
                multiply_row_half(arch, &mut y, &x, &halves);
                multiply_row(arch, &mut want, &x, &panels);
                assert_eq!(y, want, "{arch:?}");
            }
        }
    }
}
