//! The submerged part of a robot's hull.
//!
//! A force model trained on submerged motion holds no depth. With a `waterline` its wrench is scaled by
//! the submerged part of the volume of the robot's hull: the geoms with coefficients of MuJoCo's
//! ellipsoid fluid, else those in group 3, else all. Each is taken as the sphere of its bounding
//! radius about its centre and weighted with its own volume. That fades the force out as the robot
//! surfaces; it is no model of waves, slamming or a changed centre of buoyancy.

use std::f64::consts::PI;

/// Certainty that a geom is part of the hull, rather than of the looks laid over it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PartOfHull {
    /// Nothing says so.
    Perhaps,
    /// It is in group 3, where MuJoCo's models keep what is not for the eye.
    ByGroup,
    /// MuJoCo's ellipsoid fluid acts on it.
    ByFluid,
}

impl PartOfHull {
    /// Part of a geom with this interaction coefficient of the ellipsoid fluid (0: none) and this group.
    pub fn from_geom(fluid: f64, group: i32) -> Self {
        match group {
            _ if fluid > 0.0 => Self::ByFluid,
            3 => Self::ByGroup,
            _ => Self::Perhaps,
        }
    }
}

/// One geom of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lump {
    /// World z of its centre [m].
    pub height: f64,
    /// Bounding radius [m].
    pub radius: f64,
    /// Volume [m^3].
    pub volume: f64,
}

/// Submerged part (0..=1) of a sphere whose centre lies `depth` below the surface: with
/// u = (depth + r) / 2r the cap's part is u^2 (3 - 2u).
fn submerged_part(depth: f64, radius: f64) -> f64 {
    if radius <= 0.0 {
        return if depth >= 0.0 { 1.0 } else { 0.0 };
    }
    let u = ((depth + radius) / (2.0 * radius)).clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}

/// Volume-weighted submerged part of the lumps, 0..=1; 1 where there is nothing to weigh.
pub fn submerged_fraction(waterline: f64, lumps: impl Iterator<Item = Lump>) -> f64 {
    let (mut wet, mut all) = (0.0, 0.0);
    for lump in lumps {
        wet += lump.volume * submerged_part(waterline - lump.height, lump.radius);
        all += lump.volume;
    }
    if all > 0.0 { wet / all } else { 1.0 }
}

/// Shapes whose volume has a closed form; sizes are MuJoCo's half sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// radius
    Sphere,
    /// radius, half length of the cylindrical part
    Capsule,
    /// three semi-axes
    Ellipsoid,
    /// radius, half length
    Cylinder,
    /// three half lengths
    Box,
    /// Anything else: its bounding sphere.
    Other,
}

/// Volume of a geom [m^3] from its sizes [m]; `bounding_radius` serves shapes without a closed form.
pub fn volume(shape: Shape, [a, b, c]: [f64; 3], bounding_radius: f64) -> f64 {
    let ball = |radius: f64| 4.0 / 3.0 * PI * radius.powi(3);
    match shape {
        Shape::Sphere => ball(a),
        Shape::Capsule => ball(a) + PI * a * a * 2.0 * b,
        Shape::Ellipsoid => 4.0 / 3.0 * PI * a * b * c,
        Shape::Cylinder => PI * a * a * 2.0 * b,
        Shape::Box => 8.0 * a * b * c,
        Shape::Other => ball(bounding_radius),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lump(height: f64, volume: f64) -> Lump {
        Lump {
            height,
            radius: 0.5,
            volume,
        }
    }

    #[test]
    fn half_a_ball_is_under_when_its_centre_is_at_the_surface() {
        let fraction = |height| submerged_fraction(0.0, std::iter::once(lump(height, 2.0)));
        assert_eq!(fraction(-2.0), 1.0);
        assert_eq!(fraction(2.0), 0.0);
        assert!((fraction(0.0) - 0.5).abs() < 1e-12);
        // A cap of height r/2: (pi h^2 / 3)(3r - h) of 4/3 pi r^3 = 5/32.
        assert!((fraction(0.25) - 5.0 / 32.0).abs() < 1e-12);
    }

    #[test]
    fn the_larger_volume_weighs_more() {
        let lumps = [lump(-2.0, 3.0), lump(2.0, 1.0)];
        assert!((submerged_fraction(0.0, lumps.into_iter()) - 0.75).abs() < 1e-12);
        assert_eq!(submerged_fraction(0.0, std::iter::empty()), 1.0);
    }

    #[test]
    fn volumes_of_the_primitives() {
        assert!((volume(Shape::Box, [0.5, 1.0, 1.5], 9.0) - 6.0).abs() < 1e-12);
        assert!(
            (volume(Shape::Capsule, [1.0, 0.0, 0.0], 9.0)
                - volume(Shape::Sphere, [1.0, 0.0, 0.0], 9.0))
            .abs()
                < 1e-12
        );
        assert!(
            (volume(Shape::Ellipsoid, [1.0, 1.0, 1.0], 9.0) - volume(Shape::Other, [0.0; 3], 1.0))
                .abs()
                < 1e-12
        );
    }
}
