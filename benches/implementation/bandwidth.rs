//! The bandwidth limit: reading numbers once, with one core and its widest vectors.

use std::{hint::black_box, time::Instant};

use pulp::{Arch, Simd, WithSimd};

use crate::{
    error::Result,
    implementation::{Block, Implementation},
};

/// Vectors added side by side, so that no addition waits for another.
const CHAINS: usize = 8;

struct Sum<'a>(&'a [f32]);

impl WithSimd for Sum<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let (vectors, rest) = S::as_simd_f32s(self.0);
        let (groups, tail) = vectors.as_chunks::<CHAINS>();
        let mut sums = [simd.splat_f32s(0.0); CHAINS];
        for group in groups {
            for (sum, vector) in sums.iter_mut().zip(group) {
                *sum = simd.add_f32s(*sum, *vector);
            }
        }
        for (sum, vector) in sums.iter_mut().zip(tail) {
            *sum = simd.add_f32s(*sum, *vector);
        }
        let sums = sums.map(|sum| simd.reduce_sum_f32s(sum));
        sums.iter().chain(rest).sum()
    }
}

/// Sum of all numbers.
pub(crate) fn sum(numbers: &[f32]) -> f32 {
    Arch::new().dispatch(Sum(numbers))
}

/// An array of as many bytes as a model's weights.
pub(crate) struct Read(Vec<f32>);

impl Read {
    pub(crate) fn new(bytes: usize) -> Self {
        Self(vec![1.0; bytes / size_of::<f32>()])
    }
}

impl Implementation for Read {
    /// The sum of ones: how many numbers were read.
    fn check(&mut self) -> Result<Vec<f64>> {
        Ok(vec![f64::from(sum(&self.0))])
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let begin = Instant::now();
        for _ in 0..count {
            black_box(sum(black_box(&self.0)));
        }
        Ok(Block::timed(begin.elapsed().as_secs_f64()))
    }
}
