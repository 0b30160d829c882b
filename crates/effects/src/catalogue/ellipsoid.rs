//! Added mass of an ellipsoid in an ideal fluid.

/// Thinner than this share of the longest extent, an ellipsoid is taken to be this thick.
const THINNEST: f64 = 1e-3;
/// Below this relative difference of two squared semi-axes, rotation about the third stirs nothing.
const ROUND: f64 = 1e-7;

/// Added mass along the axes, as shares of the displaced mass [1], and added inertia about them, per
/// displaced mass [m^2]; `extent` are the full axes [m].
///
/// H. Lamb, Hydrodynamics, 6th ed. 1932, articles 114 and 115: with
/// alpha = abc int_0^inf dl / ((a^2 + l) Delta(l)) and so on (their sum is 2), the shares are
/// alpha / (2 - alpha). The integral is 2/3 of Carlson's R_D.
pub(crate) fn added_mass(extent: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let longest = extent.into_iter().fold(0.0, f64::max);
    if longest <= 0.0 {
        return ([0.0; 3], [0.0; 3]);
    }
    // In units of half the longest extent.
    let semi = extent.map(|extent| (extent / longest).max(THINNEST));
    let square = semi.map(|semi| semi * semi);
    let [a, b, c] = square;
    let product = 2.0 / 3.0 * semi[0] * semi[1] * semi[2];
    let alpha = product * carlson_rd(b, c, a);
    let beta = product * carlson_rd(c, a, b);
    let lamb = [alpha, beta, 2.0 - alpha - beta];

    let mass = lamb.map(|lamb| lamb / (2.0 - lamb));
    let inertia = [0, 1, 2].map(|axis| {
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let (difference, total) = (square[j] - square[k], square[j] + square[k]);
        if difference.abs() < ROUND * total {
            return 0.0;
        }
        let pull = lamb[k] - lamb[j];
        let per_square = difference * difference * pull / (2.0 * difference - total * pull) / 5.0;
        (per_square * (0.5 * longest).powi(2)).max(0.0)
    });
    (mass, inertia)
}

/// Carlson's R_D(x, y, z) = 3/2 int_0^inf dt / ((t + z) sqrt((t + x)(t + y)(t + z))), by duplication.
///
/// B. C. Carlson, Numerical Algorithms 10, 1995, algorithm for R_D.
fn carlson_rd(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    let (mut sum, mut power) = (0.0, 1.0);
    // Each round brings the three closer by a factor of four; the series below is of sixth order.
    for _ in 0..40 {
        let mean = (x + y + 3.0 * z) / 5.0;
        let spread = (mean - x).abs().max((mean - y).abs()).max((mean - z).abs());
        if spread < 2e-3 * mean {
            break;
        }
        let (rx, ry, rz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = rx * ry + ry * rz + rz * rx;
        sum += power / (rz * (z + lambda));
        power *= 0.25;
        x = 0.25 * (x + lambda);
        y = 0.25 * (y + lambda);
        z = 0.25 * (z + lambda);
    }
    let mean = (x + y + 3.0 * z) / 5.0;
    let (dx, dy, dz) = ((mean - x) / mean, (mean - y) / mean, (mean - z) / mean);
    let (ea, eb) = (dx * dy, dz * dz);
    let (ec, ed) = (ea - eb, ea - 6.0 * eb);
    let ee = ed + 2.0 * ec;
    let series = 1.0
        + ed * (-3.0 / 14.0 + 9.0 / 88.0 * ed - 9.0 / 52.0 * dz * ee)
        + dz * (ee / 6.0 + dz * (-9.0 / 22.0 * ec + dz * 3.0 / 26.0 * ea));
    3.0 * sum + power * series / (mean * mean.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_has_half_of_its_displaced_mass() {
        let (mass, inertia) = added_mass([0.3, 0.3, 0.3]);
        for share in mass {
            assert!((share - 0.5).abs() < 1e-9);
        }
        assert_eq!(inertia, [0.0; 3]);
    }

    /// The closed form of Carlson's integral at equal arguments, and by quadrature elsewhere.
    #[test]
    fn carlsons_integral_agrees_with_quadrature() {
        assert!((carlson_rd(2.0, 2.0, 2.0) - 2.0_f64.powf(-1.5)).abs() < 1e-12);
        let (x, y, z) = (0.1, 1.3, 0.4);
        // t = u / (1 - u) maps to the unit interval.
        let count = 400_000;
        let integral: f64 = (0..count)
            .map(|index| {
                let u = (f64::from(index) + 0.5) / f64::from(count);
                let t = u / (1.0 - u);
                let root = ((t + x) * (t + y) * (t + z)).sqrt();
                1.5 / ((t + z) * root) / (1.0 - u).powi(2) / f64::from(count)
            })
            .sum();
        assert!((carlson_rd(x, y, z) / integral - 1.0).abs() < 1e-5);
    }

    /// A prolate spheroid, closed form (Lamb 1932, article 114): with eccentricity e,
    /// alpha = 2 (1 - e^2) / e^3 (artanh e - e), and beta = gamma = 1 - alpha / 2. For twice its width Lamb's
    /// table has 0.209 and 0.702, and 0.240 of the displaced water's moment of inertia.
    #[test]
    fn a_spheroid_agrees_with_lamb() {
        let (mass, inertia) = added_mass([0.8, 0.4, 0.4]);
        let e = 0.75_f64.sqrt();
        let alpha = 2.0 * 0.25 / e.powi(3) * (e.atanh() - e);
        let beta = 1.0 - 0.5 * alpha;
        for (found, lamb) in mass.into_iter().zip([alpha, beta, beta]) {
            assert!((found - lamb / (2.0 - lamb)).abs() < 1e-9, "{mass:?}");
        }
        for (found, table) in mass.into_iter().zip([0.209, 0.702, 0.702]) {
            assert!((found - table).abs() < 3e-3, "{mass:?}");
        }
        let displaced = (0.16 + 0.04) / 5.0;
        assert!((inertia[1] / displaced - 0.240).abs() < 3e-3, "{inertia:?}");
        assert!(inertia[0].abs() < 1e-12);
    }

    /// A thin disc: 8/3 rho r^3 along its axis (Lamb 1932, article 108).
    #[test]
    fn a_disc_agrees_with_lamb() {
        let thickness = 0.002;
        let (mass, _) = added_mass([thickness, 1.0, 1.0]);
        let volume = std::f64::consts::PI / 6.0 * thickness;
        assert!((mass[0] * volume / (8.0 / 3.0 * 0.125) - 1.0).abs() < 5e-3);
    }
}
