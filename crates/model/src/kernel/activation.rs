//! SiLU, its derivative, the sigmoid and the softmax, on vectors of f32.

use pulp::{Arch, Simd, WithSimd};

/// x -> silu(x) in place.
pub(crate) fn silu(arch: Arch, values: &mut [f32]) {
    arch.dispatch(Silu(values));
}

/// x -> 1 / (1 + e^-x) in place.
pub(crate) fn sigmoid(arch: Arch, values: &mut [f32]) {
    arch.dispatch(Sigmoid(values));
}

/// e^x = 2^n e^r with |r| <= ln 2 / 2, the polynomial of Cephes' `expf` (S. Moshier, "Methods and Programs for
/// Mathematical Functions", 1989); relative error about 1e-7. Held at e^-87 and e^87.
#[inline(always)]
fn exponential<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
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
    // Beyond 87 the exponential leaves the range of f32.
    let t = simd.min_f32s(
        simd.max_f32s(x, simd.splat_f32s(-87.0)),
        simd.splat_f32s(87.0),
    );
    let shifted = simd.mul_add_e_f32s(
        t,
        simd.splat_f32s(std::f32::consts::LOG2_E),
        simd.splat_f32s(MAGIC),
    );
    let n = simd.sub_f32s(shifted, simd.splat_f32s(MAGIC));
    let r = simd.negate_mul_add_e_f32s(n, simd.splat_f32s(LN2_HIGH), t);
    let r = simd.negate_mul_add_e_f32s(n, simd.splat_f32s(LN2_LOW), r);
    let mut p = simd.splat_f32s(POLYNOMIAL[0]);
    for coefficient in &POLYNOMIAL[1..] {
        p = simd.mul_add_e_f32s(p, r, simd.splat_f32s(*coefficient));
    }
    let p = simd.add_f32s(
        simd.mul_add_e_f32s(simd.mul_f32s(r, r), p, r),
        simd.splat_f32s(1.0),
    );
    // 2^n: n + 127 into the exponent; the bits of MAGIC fall off at the top.
    let exponent = simd.add_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(127));
    let power = simd.transmute_f32s_u32s(simd.wrapping_dyn_shl_u32s(exponent, simd.splat_u32s(23)));
    simd.mul_f32s(p, power)
}

/// 1 / (1 + e^-x).
#[inline(always)]
fn gate<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let one = simd.splat_f32s(1.0);
    simd.div_f32s(one, simd.add_f32s(exponential(simd, simd.neg_f32s(x)), one))
}

/// `value` where x is above -104 or no number; 0 below, where silu and its slope are under 1e-43.
#[inline(always)]
fn unless_far_below<S: Simd>(simd: S, x: S::f32s, value: S::f32s) -> S::f32s {
    let below = simd.less_than_f32s(x, simd.splat_f32s(-104.0));
    simd.select_f32s(below, simd.splat_f32s(0.0), value)
}

/// silu(x).
#[inline(always)]
fn value<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    unless_far_below(simd, x, simd.mul_f32s(x, gate(simd, x)))
}

/// gradient * d silu(z)/dz. A function, not a closure: only what is inlined here is compiled for the vector unit.
#[inline(always)]
fn slope<S: Simd>(simd: S, z: S::f32s, gradient: S::f32s) -> S::f32s {
    let one = simd.splat_f32s(1.0);
    let gate = gate(simd, z);
    let slope = simd.mul_add_e_f32s(z, simd.sub_f32s(one, gate), one);
    let slope = unless_far_below(simd, z, simd.mul_f32s(gate, slope));
    simd.mul_f32s(gradient, slope)
}

/// x -> silu(x), in place.
struct Silu<'a>(&'a mut [f32]);

impl WithSimd for Silu<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (vectors, rest) = S::as_mut_simd_f32s(self.0);
        for x in vectors {
            *x = value(simd, *x);
        }
        if !rest.is_empty() {
            let x = simd.partial_load_f32s(rest);
            simd.partial_store_f32s(rest, value(simd, x));
        }
    }
}

/// z -> gradient * d silu(z)/dz, in place of z.
pub(super) struct SiluBackward<'a>(pub(super) &'a mut [f32], pub(super) &'a [f32]);

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

/// [`gate`], and no number of what is none: the exponential alone would hide it.
#[inline(always)]
fn open<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    simd.select_f32s(simd.equal_f32s(x, x), gate(simd, x), x)
}

/// x -> 1 / (1 + e^-x), in place.
struct Sigmoid<'a>(&'a mut [f32]);

impl WithSimd for Sigmoid<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (vectors, rest) = S::as_mut_simd_f32s(self.0);
        for x in vectors {
            *x = open(simd, *x);
        }
        if !rest.is_empty() {
            let x = simd.partial_load_f32s(rest);
            simd.partial_store_f32s(rest, open(simd, x));
        }
    }
}

/// Numbers that are taken side by side where an order must be the same on every machine.
const LANES: usize = 16;

/// Combines all `values`: 16 partial results side by side, then these in order, the same on every machine.
#[inline(always)]
fn reduce(values: &[f32], start: f32, mut combine: impl FnMut(f32, f32) -> f32) -> f32 {
    let mut lanes = [start; LANES];
    let (groups, rest) = values.as_chunks::<LANES>();
    for group in groups {
        for (lane, value) in lanes.iter_mut().zip(group) {
            *lane = combine(*lane, *value);
        }
    }
    for (lane, value) in lanes.iter_mut().zip(rest) {
        *lane = combine(*lane, *value);
    }
    lanes.into_iter().fold(start, combine)
}

/// In place, each of the numbers e^(x - max) / sum, the same on every machine.
#[inline(always)]
pub(crate) fn softmax<S: Simd>(simd: S, values: &mut [f32]) {
    let largest = reduce(values, f32::MIN, |a, b| if b > a { b } else { a });
    let shift = simd.splat_f32s(largest);
    let (vectors, rest) = S::as_mut_simd_f32s(values);
    for x in vectors {
        *x = exponential(simd, simd.sub_f32s(*x, shift));
    }
    if !rest.is_empty() {
        let x = simd.sub_f32s(simd.partial_load_f32s(rest), shift);
        simd.partial_store_f32s(rest, exponential(simd, x));
    }
    let scale = 1.0 / reduce(values, 0.0, |a, b| a + b);
    for value in values {
        *value *= scale;
    }
}
