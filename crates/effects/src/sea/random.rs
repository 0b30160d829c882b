//! Random numbers as a pure function of a seed, a stream and a counter.
//!
//! Philox-4x64 with ten rounds: J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC 2011. The key is
//! (seed, stream), the counter (counter, 0, 0, 0). Files that name a seed must give the same sea in every version: nothing
//! here may change.

use std::f64::consts::TAU;

use super::elementary::sin_cos;

/// Stream of the components of a spectrum.
pub(crate) const WAVES: u64 = 1;
/// Stream of a random current.
pub(crate) const CURRENT: u64 = 2;

const MULTIPLIERS: [u64; 2] = [0xD2E7_470E_E14C_6C93, 0xCA5A_8263_9512_1157];
const WEYL: [u64; 2] = [0x9E37_79B9_7F4A_7C15, 0xBB67_AE85_84CA_A73B];
const ROUNDS: usize = 10;

/// Four words of 64 random bits.
pub(crate) fn words(seed: u64, stream: u64, counter: u64) -> [u64; 4] {
    let mut key = [seed, stream];
    let mut word = [counter, 0, 0, 0];
    for _ in 0..ROUNDS {
        let [(high0, low0), (high1, low1)] = [(0, word[0]), (1, word[2])].map(|(index, word)| {
            let product = u128::from(MULTIPLIERS[index]) * u128::from(word);
            ((product >> 64) as u64, product as u64)
        });
        word = [
            high1 ^ word[1] ^ key[0],
            low1,
            high0 ^ word[3] ^ key[1],
            low0,
        ];
        key = [0, 1].map(|index| key[index].wrapping_add(WEYL[index]));
    }
    word
}

/// Four numbers, uniform between 0 and 1, never 0 or 1: the 2^52 middles of equal intervals.
pub(crate) fn uniform(seed: u64, stream: u64, counter: u64) -> [f64; 4] {
    words(seed, stream, counter).map(|word| ((word >> 12) as f64 + 0.5) * f64::EPSILON)
}

/// Four independent numbers of the standard normal distribution.
///
/// G. E. P. Box and M. E. Muller, Annals of Mathematical Statistics 29, 1958.
pub(crate) fn normal(seed: u64, stream: u64, counter: u64) -> [f64; 4] {
    let [a, b, c, d] = uniform(seed, stream, counter);
    let pair = |u: f64, v: f64| {
        let radius = (-2.0 * libm::log(u)).sqrt();
        let (sin, cos) = sin_cos(TAU * v);
        [radius * cos, radius * sin]
    };
    let ([a, b], [c, d]) = (pair(a, b), pair(c, d));
    [a, b, c, d]
}
