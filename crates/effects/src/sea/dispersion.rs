//! Dispersion of linear waves: omega^2 = g k tanh(k d).

/// Most steps of Newton's method; from this start five are enough at every depth.
const STEPS: usize = 8;

/// Wave number k [rad/m] of an angular frequency [rad/s], for a depth [m] (infinity: deep) and gravity [m/s^2], to rounding.
///
/// Newton's method on x tanh x = a, a = omega^2 d / g, from x = a / sqrt(tanh a) (C. Eckart, The propagation of gravity
/// waves from deep to shallow water, NBS Circular 521, 1952; within 5 % everywhere). All three are above zero.
pub fn wavenumber(frequency: f64, depth: f64, gravity: f64) -> f64 {
    let deep = frequency * frequency / gravity;
    let a = deep * depth;
    // tanh x is 1 to the last bit.
    if a > 20.0 {
        return deep;
    }
    let mut x = a / libm::tanh(a).sqrt();
    for _ in 0..STEPS {
        let tanh = libm::tanh(x);
        let change = (x * tanh - a) / (tanh + x * (1.0 - tanh) * (1.0 + tanh));
        x -= change;
        if change.abs() <= 4.0 * f64::EPSILON * x {
            break;
        }
    }
    x / depth
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_relation_holds_to_rounding() {
        for exponent in -60..60 {
            let depth = 10.0_f64.powf(0.1 * f64::from(exponent));
            for (frequency, gravity) in [(0.05_f64, 9.81), (1.0, 9.81), (1.7, 1.62), (12.0, 9.81)] {
                let k = wavenumber(frequency, depth, gravity);
                let found = gravity * k * (k * depth).tanh();
                let error = found / frequency.powi(2) - 1.0;
                assert!(
                    error.abs() < 4.0 * f64::EPSILON,
                    "{frequency} {depth}: {error:e}"
                );
            }
        }
    }

    #[test]
    fn deep_and_shallow_limits() {
        let omega = 2.0_f64;
        let deep = omega * omega / 9.81;
        assert_eq!(wavenumber(omega, f64::INFINITY, 9.81), deep);
        assert!((wavenumber(omega, 100.0, 9.81) / deep - 1.0).abs() < 1e-15);
        // Shallow: k = omega / sqrt(g d) (1 + omega^2 d / (6 g)) to second order.
        let depth = 1e-3_f64;
        let shallow = omega / (9.81 * depth).sqrt() * (1.0 + omega * omega * depth / (6.0 * 9.81));
        assert!((wavenumber(omega, depth, 9.81) / shallow - 1.0).abs() < 1e-8);
    }

    /// python -c "from math import *; from scipy.optimize import brentq; w = 2*pi/4;
    ///     print(brentq(lambda k: 9.81*k*tanh(3*k) - w*w, 1e-3, 10, xtol=1e-16, rtol=1e-15))"
    #[test]
    fn as_computed_independently() {
        let k = wavenumber(std::f64::consts::TAU / 4.0, 3.0, 9.81);
        assert!((k - 0.331_347_034_117_641_6).abs() < 1e-14, "{k:.17}");
    }
}
