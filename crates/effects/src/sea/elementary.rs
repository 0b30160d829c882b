//! Sine, cosine and exponential without branches, in basic arithmetic alone: loops over them become vector code, and every
//! machine gives the same bits.
//!
//! Polynomials and the split of pi/2 and ln 2: fdlibm, Sun Microsystems 1993.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_4, LOG2_E};

/// 1.5 * 2^52: added to a number below 2^51, the sum's last bits are the nearest whole number.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// pi/2 in three parts, the first two of 33 bits.
const HALF_PI: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];
/// ln 2 in two parts, the first of 33 bits.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];

/// Coefficients of r^3, r^5, ... of the sine.
const SINE: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_49,
    -0.000_198_412_698_298_579_5,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
/// Coefficients of r^4, r^6, ... of the cosine.
const COSINE: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_411,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];
/// Coefficients 1/13!, 1/12!, ..., 1/2! of the exponential.
const EXPONENTIAL: [f64; 12] = {
    let mut coefficients = [0.0; 12];
    let mut factorial = 1.0;
    let mut n = 2;
    while n <= 13 {
        factorial *= n as f64;
        coefficients[13 - n] = 1.0 / factorial;
        n += 1;
    }
    coefficients
};

#[inline(always)]
fn horner(x: f64, from_constant: &[f64; 6]) -> f64 {
    let [a, b, c, d, e, f] = from_constant;
    a + x * (b + x * (c + x * (d + x * (e + x * f))))
}

/// Sine and cosine, to 2^-52 plus the rounding of the argument (2^-53 of its size), for any size below 2^50; beyond it
/// some number between -1 and 1. Not a number gives not a number.
#[inline(always)]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    let rounded = x * FRAC_2_PI + ROUND;
    let quarter = rounded.to_bits();
    let turns = rounded - ROUND;
    let r = ((x - turns * HALF_PI[0]) - turns * HALF_PI[1]) - turns * HALF_PI[2];
    let r = r.clamp(-FRAC_PI_4 - 0.01, FRAC_PI_4 + 0.01);
    let square = r * r;
    let sine = (r + r * square * horner(square, &SINE)).to_bits();
    let cosine = (1.0 - 0.5 * square + square * square * horner(square, &COSINE)).to_bits();
    let swap = (quarter & 1).wrapping_neg();
    let sine_sign = (quarter & 2) << 62;
    let cosine_sign = (quarter.wrapping_add(1) & 2) << 62;
    (
        f64::from_bits(((sine & !swap) | (cosine & swap)) ^ sine_sign),
        f64::from_bits(((cosine & !swap) | (sine & swap)) ^ cosine_sign),
    )
}

/// exp(x) for x from -700 to 0, relative error below 2^-51; outside, the value of the nearer end. Not a number gives not a
/// number.
#[inline(always)]
pub(crate) fn exp_of_negative(x: f64) -> f64 {
    let x = x.clamp(-700.0, 0.0);
    let rounded = x * LOG2_E + ROUND;
    let power = rounded - ROUND;
    let r = (x - power * LN_2[0]) - power * LN_2[1];
    let mut sum = EXPONENTIAL[0];
    for coefficient in &EXPONENTIAL[1..] {
        sum = sum * r + coefficient;
    }
    let exponential = 1.0 + (r + r * r * sum);
    exponential * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_those_of_the_library() {
        for index in -200_000..200_000 {
            let x = f64::from(index) * 0.012_345_678_9;
            let (sin, cos) = sin_cos(x);
            let error = (sin - x.sin()).abs().max((cos - x.cos()).abs());
            assert!(error <= f64::EPSILON, "{x}: {error:e}");
        }
        for x in [3e7_f64, -1.234_567e9, 8e12, -1e15] {
            let (sin, cos) = sin_cos(x);
            let error = (sin - x.sin()).abs().max((cos - x.cos()).abs());
            assert!(
                error <= f64::EPSILON * (1.0 + 0.5 * x.abs()),
                "{x}: {error:e}"
            );
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn sine_and_cosine_of_anything_are_at_most_one() {
        for x in [
            1e16,
            -1e20,
            1e300,
            f64::MAX,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ] {
            let (sin, cos) = sin_cos(x);
            let within = |number: f64| number.is_nan() || number.abs() <= 1.0;
            assert!(within(sin) && within(cos), "{x}: {sin} {cos}");
        }
        let (sin, cos) = sin_cos(f64::NAN);
        assert!(sin.is_nan() && cos.is_nan());
    }

    #[test]
    fn the_exponential_is_that_of_the_library() {
        for index in 0..70_000 {
            let x = -0.01 * f64::from(index);
            let error = exp_of_negative(x) / x.exp() - 1.0;
            assert!(error.abs() <= 2.0 * f64::EPSILON, "{x}: {error:e}");
        }
        assert_eq!(exp_of_negative(0.0), 1.0);
        assert_eq!(exp_of_negative(5.0), 1.0);
        assert_eq!(exp_of_negative(f64::NEG_INFINITY), exp_of_negative(-700.0));
        assert!(exp_of_negative(f64::NAN).is_nan());
    }
}
