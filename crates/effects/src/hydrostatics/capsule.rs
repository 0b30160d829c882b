//! Capsule below a plane: a cylinder and two half balls.

use std::f64::consts::{FRAC_PI_4, PI};

use nalgebra::Vector3;

use super::{
    cylinder,
    ellipsoid::{self, unit_cap},
    part::Part,
};

/// Volume of a capsule [m^3]; `half_length` is the cylinder's.
pub(super) fn volume(radius: f64, half_length: f64) -> f64 {
    cylinder::volume(radius, half_length) + ellipsoid::volume(&Vector3::from_element(radius))
}

/// The part of a capsule about z below a plane.
pub(super) fn below(radius: f64, half_length: f64, up: &Vector3<f64>, level: f64) -> Part {
    let end = Vector3::new(0.0, 0.0, half_length);
    let lift = up.z * half_length;
    let upper = half_ball(radius, up, level - lift);
    // The lower half ball is an upper one in a mirror.
    let mirrored = |v: Vector3<f64>| Vector3::new(v.x, v.y, -v.z);
    let mut lower = half_ball(radius, &mirrored(*up), level + lift);
    lower.moment = mirrored(lower.moment);
    cylinder::below(radius, half_length, up, level) + upper.shifted(&end) + lower.shifted(&-end)
}

/// The part `up.x <= level` of the half ball `z >= 0` about its ball's centre.
fn half_ball(radius: f64, up: &Vector3<f64>, level: f64) -> Part {
    let (cube, axis) = (radius.powi(3), Vector3::z());
    let part = |volume: f64, moment: Vector3<f64>| Part {
        volume: cube * volume,
        moment: cube * radius * moment,
    };
    let whole = || (2.0 / 3.0 * PI, FRAC_PI_4 * axis);
    if level >= radius {
        let (volume, moment) = whole();
        return part(volume, moment);
    }
    if level <= -radius {
        return Part::NONE;
    }
    let t = level / radius;
    let along = up.z;
    let across = (up.x * up.x + up.y * up.y).sqrt();
    if t.abs() >= across {
        // The plane misses the flat disc: the wet part is nothing, a cap, all but a cap, or all.
        let (volume, moment) = match (along > 0.0, t > 0.0) {
            (true, false) => return Part::NONE,
            (true, true) => {
                let (whole, middle) = whole();
                let (cap, height) = unit_cap(-t);
                (whole - cap, middle + up * height)
            }
            (false, false) => {
                let (cap, height) = unit_cap(t);
                (cap, up * height)
            }
            (false, true) => whole(),
        };
        return part(volume, moment);
    }
    let (volume, moment) = cut_disc(up, across, along, t);
    part(volume, moment)
}

/// The wet part of the unit half ball where the plane cuts its flat disc, `|t| < across`.
///
/// Its boundary is a patch of the sphere, a segment of the plane's disc (radius^2 = 1 - t^2) and a segment of the flat
/// disc; the two segments share a chord. Divergence theorem: the volume is the integral of `x.n / 3` over the boundary,
/// the moment that of `x.x n / 2`. `root` is half the chord times `across`: with all angles from it, rounding in it
/// cancels where the chord vanishes.
fn cut_disc(up: &Vector3<f64>, across: f64, along: f64, t: f64) -> (f64, Vector3<f64>) {
    let root = ((across - t) * (across + t)).sqrt();
    let half_chord = root / across;
    // Segments `q <= chord` of a disc: the angle that the arc spans is twice this one.
    let plane_angle = root.atan2(-t * along);
    let flat_angle = root.atan2(-t);
    let patch = 2.0 * (root.atan2(along) + t * plane_angle);

    let (plane_chord, flat_chord) = (t * along / across, t / across);
    let plane_square = (1.0 - t) * (1.0 + t);
    let area = |square: f64, angle: f64, chord: f64| square * angle + chord * half_chord;
    let polar = |square: f64, angle: f64, chord: f64| {
        0.5 * square * square * angle
            + chord * half_chord * (0.5 * chord * chord + half_chord * half_chord / 6.0)
    };
    let plane = area(plane_square, plane_angle, plane_chord);
    let flat = area(1.0, flat_angle, flat_chord);
    let plane_polar = polar(plane_square, plane_angle, plane_chord);
    let flat_polar = polar(1.0, flat_angle, flat_chord);

    let on_plane = 0.5 * (plane_polar - plane_square * plane);
    let on_flat = 0.5 * (flat - flat_polar);
    (
        ((patch + t * plane) / 3.0).max(0.0),
        up * on_plane + Vector3::new(0.0, 0.0, on_flat),
    )
}
