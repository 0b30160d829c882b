//! Limits of linear waves and of Morison's force.

use std::f64::consts::PI;

/// Greatest steepness, height by length, of a wave that does not break, for k d [rad] (infinity: deep): tanh(k d) / 7.
///
/// R. Miche, Annales des Ponts et Chaussees 114, 1944 (0.142 there); in shallow water the height is then 0.9 of the depth.
pub fn steepest(wavenumber_times_depth: f64) -> f64 {
    libm::tanh(wavenumber_times_depth) / 7.0
}

/// Amplitude of the second harmonic of the elevation in parts of the first, at the second order of Stokes:
/// k a (3 - T^2) / (4 T^3), T = tanh(k d). It is k a / 2 in deep water and 3/4 a / (k^2 d^3) in shallow, so that one number
/// holds both limits of linear theory: steepness, and length in shallow water.
///
/// R. G. Dean and R. A. Dalrymple, Water Wave Mechanics for Engineers and Scientists, World Scientific 1991, chapter 11.
pub fn second_harmonic(wavenumber_times_amplitude: f64, wavenumber_times_depth: f64) -> f64 {
    let tanh = libm::tanh(wavenumber_times_depth);
    wavenumber_times_amplitude * (3.0 - tanh * tanh) / (4.0 * tanh * tanh * tanh)
}

/// Force of a linear wave on an upright cylinder that scatters it, in parts of the long-wave force (undisturbed pressure
/// plus added mass, an inertia coefficient of 2); diameter and length of the wave [m].
///
/// 2 / (pi (k r)^2 |H_1'(k r)|), r the radius, H_1 the Hankel function of the first order: R. C. MacCamy and R. A. Fuchs,
/// Wave forces on piles, Beach Erosion Board, Technical Memorandum 69, 1954. It is 1 for small cylinders, 0.94 at a diameter
/// of a fifth of the length, 0.40 at half of it.
pub fn maccamy_fuchs(diameter: f64, length: f64) -> f64 {
    let x = PI * diameter / length;
    if x < 1e-6 {
        return 1.0;
    }
    let slope = |zeroth: f64, first: f64| zeroth - first / x;
    let hankel = libm::hypot(
        slope(libm::j0(x), libm::j1(x)),
        slope(libm::y0(x), libm::y1(x)),
    );
    2.0 / (PI * x * x * hankel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deep_and_shallow_limits() {
        assert!((steepest(f64::INFINITY) - 1.0 / 7.0).abs() < 1e-16);
        // Height by depth: steepest * length / depth = steepest * 2 pi / (k d).
        assert!((steepest(1e-4) * 2.0 * PI / 1e-4 - 0.898).abs() < 1e-3);
        assert!((second_harmonic(0.1, f64::INFINITY) - 0.05).abs() < 1e-16);
        let (ka, kd) = (1e-4_f64, 1e-2_f64);
        assert!((second_harmonic(ka, kd) / (0.75 * ka / kd.powi(3)) - 1.0).abs() < 1e-4);
    }

    /// python -c "from scipy.special import h1vp; from math import *;
    ///     print([2/(pi*x*x*abs(h1vp(1, x))) for x in (0.01*pi, 0.2*pi, 0.5*pi, 2*pi)])"
    #[test]
    fn scattering_as_computed_independently() {
        let independent = [
            1.001_519_312_225_980_7,
            0.943_410_637_847_643_1,
            0.395_288_852_617_286_6,
            0.050_726_173_393_842_14,
        ];
        for (share, expected) in [0.01, 0.2, 0.5, 2.0].into_iter().zip(independent) {
            let found = maccamy_fuchs(share, 1.0);
            assert!((found - expected).abs() < 1e-12, "{share}: {found:.16}");
        }
        assert_eq!(maccamy_fuchs(1e-9, 1.0), 1.0);
    }
}
