//! Rows with weights and activations in whole numbers of 16 bits: half the bytes to read, and nothing to widen.
//!
//! A weight is the scale of its column times a whole number of 13 bits and a sign; an activation is the scale of its
//! block, [`BLOCK`] of them in a row, times one of 12 bits and a sign. The sum of a block's products is below 2^31 in
//! size, so `vpmaddwd` (two products and their sum, int32) and int32 additions give it exactly, in any order. A block's
//! sum then becomes an f32, times the block's scale, and the blocks are added in order by a product and a sum, each
//! rounded. No step depends on the vector unit: the portable path gives the same bits.
//!
//! Error: a weight is off by at most 1 / 16382 of the largest of its column, an activation by at most 1 / 8190 of the
//! largest of its block.

use pulp::{Arch, Simd, WithSimd, bytemuck::cast_slice_mut};
#[cfg(target_arch = "x86_64")]
use pulp::{
    bytemuck::{cast, cast_slice},
    x86::{V3, V4},
};

use super::panels::{PANEL, Panels};

/// Activations with a scale in common.
const BLOCK: usize = 64;
/// Pairs of them.
const PAIRS: usize = BLOCK / 2;
/// Largest weight: 13 bits.
const WEIGHT: f32 = 8191.0;
/// Largest activation: 12 bits. `BLOCK` products of both are below 2^31.
const ACTIVATION: f32 = 4095.0;
/// 1.5 * 2^23: adding it rounds to the nearest whole number, even in a tie, which then lies in the low bits.
const MAGIC: f32 = 12_582_912.0;

/// A word: two numbers that follow each other along k, the first in the low half.
type Word = i32;

/// B [k,n]: [ceil(n / PANEL)][ceil(k / 2)][PANEL], padded with zeros, and a scale a column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Int16Panels {
    depth: usize,
    columns: usize,
    data: Vec<[Word; PANEL]>,
    scales: Vec<[f32; PANEL]>,
}

impl Int16Panels {
    /// Rounds every weight.
    pub(crate) fn new(panels: &Panels<f32>) -> Self {
        let depth = panels.depth;
        let count = panels.columns.div_ceil(PANEL);
        let mut data = Vec::with_capacity(count * depth.div_ceil(2));
        let mut scales = Vec::with_capacity(count);
        for index in 0..count {
            let panel = panels.panel(index);
            let mut largest = [0.0f32; PANEL];
            for row in panel {
                for (largest, weight) in largest.iter_mut().zip(row) {
                    *largest = larger(*largest, *weight);
                }
            }
            scales.push(largest.map(|largest| largest / WEIGHT));
            let inverse = largest.map(|largest| inverse(WEIGHT, largest));
            for pair in panel.chunks(2) {
                let mut words = [0; PANEL];
                for (column, word) in words.iter_mut().enumerate() {
                    let whole = |row: &[f32; PANEL]| whole(row[column] * inverse[column]);
                    *word = joined(whole(&pair[0]), pair.get(1).map_or(0, whole));
                }
                data.push(words);
            }
        }
        Self {
            depth,
            columns: panels.columns,
            data,
            scales,
        }
    }

    /// n.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// Numbers of scratch that a product takes for each row of x: its words and the scales of its blocks.
    pub(crate) fn scratch(&self) -> usize {
        self.pairs() + self.depth.div_ceil(BLOCK)
    }

    fn pairs(&self) -> usize {
        self.depth.div_ceil(2)
    }

    fn panel(&self, index: usize) -> &[[Word; PANEL]] {
        &self.data[index * self.pairs()..][..self.pairs()]
    }
}

/// The larger magnitude; what is no number is larger than all, and infinity than all numbers.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    f32::from_bits(a.to_bits().max(b.abs().to_bits()))
}

/// `most` over `largest`; 0 where that is no number of f32, hence numbers below 1e-35 in size count as zero.
#[inline(always)]
fn inverse(most: f32, largest: f32) -> f32 {
    let inverse = most / largest;
    if inverse < f32::INFINITY {
        inverse
    } else {
        0.0
    }
}

/// The nearest whole number to a small one.
#[inline(always)]
fn whole(value: f32) -> Word {
    (value + MAGIC).to_bits() as i16 as Word
}

#[inline(always)]
fn joined(first: Word, second: Word) -> Word {
    first & 0xffff | second << 16
}

/// True where `arch` has an instruction for these products.
pub(crate) fn has_int16(arch: Arch) -> bool {
    match arch {
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) | Arch::V4(_) => true,
        _ => false,
    }
}

/// Y [rows,n] += X B for X [rows,k] in the instructions of `arch`; each row is by itself, whatever the others.
/// `scratch` has [`Int16Panels::scratch`] numbers a row.
pub(crate) fn multiply_int16(
    arch: Arch,
    y: &mut [f32],
    x: &[f32],
    b: &Int16Panels,
    scratch: &mut [f32],
) {
    if b.depth == 0 || b.columns == 0 {
        return;
    }
    debug_assert_eq!(x.len() / b.depth, y.len() / b.columns);
    let rows = x.len() / b.depth;
    let (words, scales) = scratch.split_at_mut(rows * b.pairs());
    let words: &mut [Word] = cast_slice_mut(words);
    let blocks = b.depth.div_ceil(BLOCK);
    for ((x, words), scales) in x
        .chunks_exact(b.depth)
        .zip(words.chunks_exact_mut(b.pairs()))
        .zip(scales.chunks_exact_mut(blocks))
    {
        arch.dispatch(Round { x, words, scales });
    }
    match arch {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => arch.dispatch(Product {
            by: Vectors::<_, { PANEL / 16 }>(simd),
            y,
            words,
            scales,
            b,
        }),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => arch.dispatch(Product {
            by: Vectors::<_, { PANEL / 8 }>(simd),
            y,
            words,
            scales,
            b,
        }),
        _ => arch.dispatch(Product {
            by: Portable,
            y,
            words,
            scales,
            b,
        }),
    }
}

/// x [k] -> words [ceil(k / 2)] and scales [ceil(k / BLOCK)].
struct Round<'a> {
    x: &'a [f32],
    words: &'a mut [Word],
    scales: &'a mut [f32],
}

impl WithSimd for Round<'_> {
    type Output = ();

    // Plain loops, which the compiler vectorises for the instructions at hand.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let blocks = self.x.chunks(BLOCK).zip(self.words.chunks_mut(PAIRS));
        for ((x, words), scale) in blocks.zip(self.scales) {
            let largest = x.iter().fold(0.0, |largest, x| larger(largest, *x));
            *scale = largest / ACTIVATION;
            let inverse = inverse(ACTIVATION, largest);
            let (pairs, last) = x.as_chunks::<2>();
            for (word, [first, second]) in words.iter_mut().zip(pairs) {
                *word = joined(whole(first * inverse), whole(second * inverse));
            }
            if let (Some(word), [last]) = (words.last_mut(), last) {
                *word = joined(whole(last * inverse), 0);
            }
        }
    }
}

/// A row's sums over one panel, before the scales of the columns.
trait Sums: Copy {
    fn sums(self, panel: &[[Word; PANEL]], words: &[Word], scales: &[f32]) -> [f32; PANEL];
}

/// Y += X B, X rounded, with the sums of `by`.
struct Product<'a, S> {
    by: S,
    y: &'a mut [f32],
    words: &'a [Word],
    scales: &'a [f32],
    b: &'a Int16Panels,
}

impl<T: Sums> WithSimd for Product<'_, T> {
    type Output = ();

    /// Panel after panel, which stays in the first-level cache for all rows.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            by,
            y,
            words,
            scales,
            b,
        } = self;
        let blocks = b.depth.div_ceil(BLOCK);
        for (index, columns) in b.scales.iter().enumerate() {
            let panel = b.panel(index);
            for ((y, words), scales) in y
                .chunks_exact_mut(b.columns)
                .zip(words.chunks_exact(b.pairs()))
                .zip(scales.chunks_exact(blocks))
            {
                let sums = by.sums(panel, words, scales);
                for ((y, sum), scale) in y[index * PANEL..].iter_mut().zip(sums).zip(columns) {
                    *y += sum * scale;
                }
            }
        }
    }
}

/// Plain loops.
#[derive(Clone, Copy)]
struct Portable;

impl Sums for Portable {
    #[inline(always)]
    fn sums(self, panel: &[[Word; PANEL]], words: &[Word], scales: &[f32]) -> [f32; PANEL] {
        let mut sums = [0.0; PANEL];
        let blocks = panel.chunks(PAIRS).zip(words.chunks(PAIRS));
        for ((panel, words), scale) in blocks.zip(scales) {
            let mut exact = [0; PANEL];
            for (row, x) in panel.iter().zip(words) {
                for (exact, w) in exact.iter_mut().zip(row) {
                    let low = Word::from(*w as i16) * Word::from(*x as i16);
                    *exact += low + (w >> 16) * (x >> 16);
                }
            }
            for (sum, exact) in sums.iter_mut().zip(exact) {
                *sum += exact as f32 * scale;
            }
        }
        sums
    }
}

/// Vector units with an instruction for two products and their sum.
#[cfg(target_arch = "x86_64")]
trait Pairs: Simd {
    /// `sum` + the products of both halves of each word.
    fn add_products(self, sum: Self::i32s, w: Self::i32s, x: Self::i32s) -> Self::i32s;

    /// The nearest singles.
    fn singles(self, sum: Self::i32s) -> Self::f32s;
}

#[cfg(target_arch = "x86_64")]
impl Pairs for V3 {
    #[inline(always)]
    fn add_products(self, sum: Self::i32s, w: Self::i32s, x: Self::i32s) -> Self::i32s {
        let products = self.multiply_wrapping_add_adjacent_i16x16(cast(w), cast(x));
        cast(self.wrapping_add_u32x8(cast(sum), cast(products)))
    }

    #[inline(always)]
    fn singles(self, sum: Self::i32s) -> Self::f32s {
        self.convert_i32x8_to_f32x8(sum)
    }
}

#[cfg(target_arch = "x86_64")]
impl Pairs for V4 {
    #[inline(always)]
    fn add_products(self, sum: Self::i32s, w: Self::i32s, x: Self::i32s) -> Self::i32s {
        let products = self.multiply_wrapping_add_adjacent_i16x32(cast(w), cast(x));
        cast(self.wrapping_add_u32x16(cast(sum), cast(products)))
    }

    #[inline(always)]
    fn singles(self, sum: Self::i32s) -> Self::f32s {
        self.convert_i32x16_to_f32x16(sum)
    }
}

/// `V` vectors a panel's row.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct Vectors<P, const V: usize>(P);

#[cfg(target_arch = "x86_64")]
impl<P: Pairs, const V: usize> Sums for Vectors<P, V> {
    #[inline(always)]
    fn sums(self, panel: &[[Word; PANEL]], words: &[Word], scales: &[f32]) -> [f32; PANEL] {
        let simd = self.0;
        let splat = |word: Word| simd.transmute_i32s_u32s(simd.splat_u32s(word as u32));
        let mut sums = [simd.splat_f32s(0.0); V];
        let blocks = panel.chunks(PAIRS).zip(words.chunks(PAIRS));
        for ((panel, words), scale) in blocks.zip(scales) {
            let mut exact = [splat(0); V];
            for (row, x) in panel.iter().zip(words) {
                let x = splat(*x);
                let row: &[P::i32s] = cast_slice(row);
                for (exact, w) in exact.iter_mut().zip(row) {
                    *exact = simd.add_products(*exact, *w, x);
                }
            }
            let scale = simd.splat_f32s(*scale);
            for (sum, exact) in sums.iter_mut().zip(exact) {
                *sum = simd.add_f32s(*sum, simd.mul_f32s(simd.singles(exact), scale));
            }
        }
        let mut row = [0.0; PANEL];
        let (slots, _) = P::as_mut_simd_f32s(&mut row);
        for (slot, sum) in slots.iter_mut().zip(sums) {
            *slot = sum;
        }
        row
    }
}

#[cfg(test)]
mod tests;
