//! Cylinder below a plane: slices across the axis are segments of a disc, whose area and moment have antiderivatives.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

use nalgebra::Vector3;

use super::part::Part;

/// Chords [radii] that move by less than this over the cylinder: slices are summed by quadrature, for the differences of
/// the antiderivatives cancel. At this bound both are exact to 1e-13 of the cylinder.
const NARROW: f64 = 0.1;

/// Gauss-Legendre abscissae and weights on 0 to 1, eight points.
const NODES: [(f64, f64); 8] = [
    (0.019_855_071_751_231_884, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_63, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_64),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_64),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

/// Volume of a cylinder [m^3].
pub(super) fn volume(radius: f64, half_length: f64) -> f64 {
    2.0 * PI * radius * radius * half_length
}

/// The part of a cylinder about z below a plane.
///
/// With `across` and `along` the normal's parts across and along the axis, a slice at `z` is wet where
/// `x <= (level - along z) / across`, `x` along the normal's part across; the chord there counts in radii. Slices below
/// `bottom` are wet whole, those above `top` dry.
pub(super) fn below(radius: f64, half_length: f64, up: &Vector3<f64>, level: f64) -> Part {
    let (h, along) = (half_length, up.z.abs());
    let across = (up.x * up.x + up.y * up.y).sqrt();
    // f64::max and f64::min pass over a quotient 0/0.
    let within = |z: f64| z.max(-h).min(h);
    let rim = across * radius;
    let (bottom, top) = (within((level - rim) / along), within((level + rim) / along));

    let area = PI * radius * radius;
    let whole = area * (bottom + h);
    let (mut volume, mut axial, mut lateral) = (whole, 0.5 * whole * (bottom - h), 0.0);
    if bottom > -h && top < h {
        // The plane cuts neither end: a column under a slope.
        let (middle, rise) = (level / along, rim / along);
        volume = area * (middle + h);
        axial = 0.5 * area * (middle * middle + 0.25 * rise * rise - h * h);
        lateral = -0.25 * area * radius * radius / along;
    } else if top > bottom {
        let chord = |z: f64| ((level - along * z) / rim).clamp(-1.0, 1.0);
        let (v, m, l) = if 2.0 * h * along < NARROW * rim {
            by_quadrature(bottom, top, chord(bottom), chord(top))
        } else {
            by_antiderivative(bottom, top, chord(bottom), chord(top), rim / along)
        };
        let square = radius * radius;
        volume += square * v;
        axial += square * m;
        lateral = square * radius * l / across;
    }
    Part {
        volume,
        moment: Vector3::new(
            up.x * lateral,
            up.y * lateral,
            if up.z < 0.0 { -axial } else { axial },
        ),
    }
}

/// Antiderivatives over the chord, between -1 and 1, of a segment's area, of its first moment, and of chord times area.
fn antiderivatives(x: f64) -> [f64; 3] {
    let square = (1.0 - x) * (1.0 + x);
    let root = square.sqrt();
    let cubed = square * root;
    let cosine = x.acos();
    let angle = PI - cosine;
    let sine = FRAC_PI_2 - cosine;
    [
        x * angle + root - cubed / 3.0,
        -2.0 / 3.0 * (x * cubed / 4.0 + 0.375 * (x * root + sine)),
        0.5 * x * x * (angle + x * root) - 0.125 * (sine - x * root * (1.0 - 2.0 * x * x)),
    ]
}

/// Integrals over z of the slices' area, z times area, and moment across, on the unit disc. `slope` is how far z moves
/// [m] for a chord that moves by one radius.
fn by_antiderivative(bottom: f64, top: f64, lower: f64, upper: f64, slope: f64) -> (f64, f64, f64) {
    let (low, high) = (antiderivatives(lower), antiderivatives(upper));
    let [area, moment, weighted] = [0, 1, 2].map(|i| low[i] - high[i]);
    let (middle, z) = (0.5 * (lower + upper), 0.5 * (bottom + top));
    let volume = slope * area;
    (
        volume,
        z * volume - slope * slope * (weighted - middle * area),
        slope * moment,
    )
}

/// The same by quadrature. A segment's area goes as distance^(3/2) where the chord leaves the disc; it is smooth in
/// `u`, the root of the distance from the nearer of the two such places, and `u^2` is linear in z.
fn by_quadrature(bottom: f64, top: f64, lower: f64, upper: f64) -> (f64, f64, f64) {
    let nearly_whole = lower + upper > 0.0;
    let distance = |x: f64| if nearly_whole { 1.0 - x } else { 1.0 + x };
    let (first, last) = (distance(lower).sqrt(), distance(upper).sqrt());
    let sum = first + last;
    let (mut volume, mut axial, mut lateral) = (0.0, 0.0, 0.0);
    for (at, weight) in NODES {
        let u = first + (last - first) * at;
        let (part, density) = if sum > 0.0 {
            (at * (u + first) / sum, 2.0 * u / sum)
        } else {
            (at, 1.0)
        };
        let z = bottom + (top - bottom) * part;
        let weight = (top - bottom) * weight * density;
        let square = u * u * (2.0 - u * u);
        let root = square.sqrt();
        // Half the angle of the segment's arc, less the triangle under it.
        let small = 2.0 * (u * FRAC_1_SQRT_2).asin() - (1.0 - u * u) * root;
        let area = if nearly_whole { PI - small } else { small };
        volume += weight * area;
        axial += weight * z * area;
        lateral -= weight * 2.0 / 3.0 * square * root;
    }
    (volume, axial, lateral)
}
