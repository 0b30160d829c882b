//! Ball and ellipsoid below a plane, in closed form.

use std::f64::consts::{FRAC_PI_4, PI};

use nalgebra::Vector3;

use super::part::Part;

/// Volume and moment along up of the part of the unit ball with `up.x <= t`, `t` within -1 and 1.
pub(super) fn unit_cap(t: f64) -> (f64, f64) {
    let below = 1.0 + t;
    let squared = below * (1.0 - t);
    (
        PI / 3.0 * below * below * (2.0 - t),
        -FRAC_PI_4 * squared * squared,
    )
}

/// Volume of an ellipsoid [m^3].
pub(super) fn volume(semi_axes: &Vector3<f64>) -> f64 {
    4.0 / 3.0 * PI * semi_axes.product()
}

/// The part of an ellipsoid below a plane. The map to the unit ball takes planes to planes and volumes to volumes over
/// `a b c`.
pub(super) fn below([a, b, c]: &[f64; 3], up: &Vector3<f64>, level: f64) -> Part {
    let normal = Vector3::new(a * up.x, b * up.y, c * up.z);
    let reach = normal.norm();
    if reach == 0.0 {
        // Flat, and seen from its edge: no volume on either side.
        return Part::NONE;
    }
    // Finite: a length whose square is above zero is not as small as that.
    let inverse = reach.recip();
    let (volume, along) = unit_cap((level * inverse).clamp(-1.0, 1.0));
    let scale = a * b * c;
    let lift = scale * along * inverse;
    Part {
        volume: scale * volume,
        moment: Vector3::new(
            a * normal.x * lift,
            b * normal.y * lift,
            c * normal.z * lift,
        ),
    }
}

/// The part of a ball below a plane.
pub(super) fn ball_below(radius: f64, up: &Vector3<f64>, level: f64) -> Part {
    let (volume, along) = unit_cap((level / radius).clamp(-1.0, 1.0));
    let cube = radius * radius * radius;
    Part {
        volume: cube * volume,
        moment: up * (cube * radius * along),
    }
}
