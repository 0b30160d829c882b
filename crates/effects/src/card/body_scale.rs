//! Sizes of a body, and reference forces made from them for priors and bounds; none of these is ever zero.
//!
//! Bounds depend on the body's sizes alone, not on its speed in the trials: values fitted to one set of trials stay
//! within bounds in the plugin, which knows no trials.

use std::f64::consts::PI;

use hydro_frames::STANDARD_GRAVITY;

use crate::catalogue::ellipsoid;

/// Density of water [kg/m^3], where a model says none.
const WATER: f64 = 1000.0;
/// Speed [m/s] and rate [rad/s] where no trials are known.
const SLOW: f64 = 0.05;
/// Speed [m/s] and rate [rad/s] at which bounds are computed.
const BRISK: f64 = 1.0;
/// Least mass [kg].
const LIGHT: f64 = 1e-6;
/// Drag coefficient of a bluff body [1].
const DRAG_COEFFICIENT: f64 = 1.0;
/// Drag of a frame with thrusters, as a multiple of that of an ellipsoid of its extents: 3 to 5 for a BlueROV2 (M. von Benzon
/// et al., An open-source benchmark simulator, J. Mar. Sci. Eng. 10(12), 2022).
const OPEN_FRAME: f64 = 3.0;
/// Expected added mass, as a multiple of that of an ellipsoid of the extents: of a sphere the displaced mass.
const STIRRED: f64 = 2.0;
/// Its least share of the displaced mass: what wings, fins and thrusters carry along a slender hull.
const LEAST_STIRRED: f64 = 0.2;
/// Bounds, as multiples of the reference value.
const GENEROUS: f64 = 100.0;

fn positive(found: f64, otherwise: f64) -> f64 {
    if found.is_finite() && found > 0.0 {
        found
    } else {
        otherwise
    }
}

/// Sizes of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyScale {
    /// Mass [kg]; of the whole tree where the body is its root.
    pub mass: f64,
    /// Moments of inertia about the body's origin, along its axes [kg m^2].
    pub inertia: [f64; 3],
    /// Extents along the body's axes [m].
    pub extent: [f64; 3],
    /// Displaced volume [m^3].
    pub volume: f64,
    /// Volume of the hull: of the body's geoms and what is welded to it, or as given [m^3].
    pub hull_volume: f64,
    /// Buoyancy of the displaced volume where a nominal of `hydro gap` has none of it; zero where it has any, and in a plugin [N].
    pub buoyancy_left_out: f64,
    /// Density of the water [kg/m^3].
    pub density: f64,
    /// Gravity [m/s^2].
    pub gravity: f64,
    /// Typical speed in the trials [m/s].
    pub speed: f64,
    /// Typical angular rate in the trials [rad/s].
    pub rate: f64,
}

impl BodyScale {
    /// All sizes one, for what does not depend on them.
    pub(crate) const ONE: Self = Self {
        mass: 1.0,
        inertia: [1.0; 3],
        extent: [1.0; 3],
        volume: 1.0,
        hull_volume: 1.0,
        buoyancy_left_out: 0.0,
        density: 1.0,
        gravity: 1.0,
        speed: 1.0,
        rate: 1.0,
    };

    pub(crate) fn typical_mass(&self) -> f64 {
        positive(self.mass, LIGHT)
    }

    pub(crate) fn typical_density(&self) -> f64 {
        positive(self.density, WATER)
    }

    pub(crate) fn typical_speed(&self) -> f64 {
        positive(self.speed, SLOW).max(SLOW)
    }

    pub(crate) fn typical_rate(&self) -> f64 {
        positive(self.rate, SLOW).max(SLOW)
    }

    pub(crate) fn typical_gravity(&self) -> f64 {
        positive(self.gravity, STANDARD_GRAVITY)
    }

    /// Volume of the hull [m^3]; of water as heavy as the body where there is no hull.
    pub(crate) fn typical_hull_volume(&self) -> f64 {
        positive(
            self.hull_volume,
            self.typical_mass() / self.typical_density(),
        )
    }

    /// Weight [N].
    pub(crate) fn weight(&self) -> f64 {
        self.typical_mass() * self.typical_gravity()
    }

    /// Extents [m], each at least a tenth of the edge of a cube of water as heavy as the body.
    pub(crate) fn typical_extent(&self) -> [f64; 3] {
        let cube = (self.typical_mass() / WATER).cbrt();
        self.extent
            .map(|extent| positive(extent, 0.0).max(0.1 * cube))
    }

    /// The greatest extent [m].
    pub(crate) fn length(&self) -> f64 {
        self.typical_extent().into_iter().fold(0.0, f64::max)
    }

    /// Mass of the displaced water [kg].
    pub(crate) fn displaced(&self) -> f64 {
        positive(
            self.typical_density() * self.volume.abs(),
            self.typical_mass(),
        )
    }

    /// Moment of inertia of the displaced water about an axis, as an ellipsoid's; no less than a tenth of
    /// the body's own [kg m^2].
    pub(crate) fn displaced_inertia(&self, axis: usize) -> f64 {
        let extent = self.typical_extent();
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let fluid = self.displaced() * (extent[j].powi(2) + extent[k].powi(2)) / 20.0;
        fluid.max(0.1 * positive(self.inertia[axis], 0.0))
    }

    /// Quadratic drag along an axis: 1/2 rho C A, A the ellipse of the extents [N s^2/m^2]. About an axis (3 to 5): of two
    /// crossed plates, with the speed and the lever of their tips everywhere, which is four times the sum over strips,
    /// because thrusters and frames stand out of a hull [N m s^2/rad^2].
    pub(crate) fn quadratic_drag(&self, axis: usize) -> f64 {
        let extent = self.typical_extent();
        let pressure = 0.5 * self.typical_density() * DRAG_COEFFICIENT;
        let (i, j, k) = (axis % 3, (axis + 1) % 3, (axis + 2) % 3);
        if axis < 3 {
            pressure * PI / 4.0 * extent[j] * extent[k]
        } else {
            pressure * extent[i] * (extent[j].powi(4) + extent[k].powi(4)) / 8.0
        }
    }

    /// Linear drag that equals the quadratic at the typical speed or rate [N s/m, N m s/rad].
    pub(crate) fn linear_drag(&self, axis: usize) -> f64 {
        self.quadratic_drag(axis) * self.typical(axis)
    }

    /// Expected quadratic drag: up to that of an open frame of the sizes, or, where it is less, the one that balances the
    /// weight at the speed of the trials. A body that falls through air is faster than the drag of water would let it be.
    pub(crate) fn expected_quadratic_drag(&self, axis: usize) -> f64 {
        let of_sizes = OPEN_FRAME * self.quadratic_drag(axis);
        if axis < 3 {
            of_sizes.min(self.weight() / self.typical_speed().powi(2))
        } else {
            of_sizes
        }
    }

    /// Linear drag that equals the expected quadratic drag at the typical speed or rate [N s/m, N m s/rad].
    pub(crate) fn expected_linear_drag(&self, axis: usize) -> f64 {
        self.expected_quadratic_drag(axis) * self.typical(axis)
    }

    /// Typical speed along an axis [m/s], or rate about one (3 to 5) [rad/s].
    fn typical(&self, axis: usize) -> f64 {
        if axis < 3 {
            self.typical_speed()
        } else {
            self.typical_rate()
        }
    }

    /// Upper bound of linear drag [N s/m, N m s/rad]: a hundred times the quadratic at 1 m/s, plus the drag that stops the
    /// body in a hundredth of a second.
    pub(crate) fn greatest_linear_drag(&self, axis: usize) -> f64 {
        GENEROUS * (self.quadratic_drag(axis) + self.own_inertia(axis)) * BRISK
    }

    /// Upper bound of quadratic drag [N s^2/m^2, N m s^2/rad^2].
    pub(crate) fn greatest_quadratic_drag(&self, axis: usize) -> f64 {
        GENEROUS * (self.quadratic_drag(axis) + self.own_inertia(axis))
    }

    /// The displaced mass along an axis, or its moment of inertia about one (3 to 5) [kg, kg m^2].
    pub(crate) fn displaced_about(&self, axis: usize) -> f64 {
        if axis < 3 {
            self.displaced()
        } else {
            self.displaced_inertia(axis - 3)
        }
    }

    /// Expected added mass along an axis, [`STIRRED`] times that of an ellipsoid of the extents and at least [`LEAST_STIRRED`] of
    /// the displaced mass [kg]; about an axis (3 to 5), the moment of inertia of the displaced water [kg m^2].
    pub(crate) fn expected_added_mass(&self, axis: usize) -> f64 {
        if axis >= 3 {
            return self.displaced_about(axis);
        }
        let (shares, _) = ellipsoid::added_mass(self.typical_extent());
        (STIRRED * shares[axis]).max(LEAST_STIRRED) * self.displaced()
    }

    /// The body's own mass, or its moment of inertia [kg, kg m^2].
    fn own_inertia(&self, axis: usize) -> f64 {
        if axis < 3 {
            self.typical_mass()
        } else {
            positive(self.inertia[axis - 3], self.displaced_inertia(axis - 3))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::OPEN_FRAME;
    use crate::{Id, card::Target, effect, tests::fixture};

    /// A ball of 57 g at 20 m/s: drag of at most its weight. A drifting hull: the drag of water.
    #[test]
    fn a_fast_light_body_is_not_expected_to_be_dragged_as_by_water() {
        let mut scale = fixture::body_scale(&fixture::still());
        scale.mass = 0.057;
        scale.speed = 20.0;
        let weight = 0.057 * scale.typical_gravity();
        let found = scale.expected_quadratic_drag(2) * 400.0;
        assert!((found - weight).abs() < 1e-9 * weight, "{found}");
        assert!((scale.expected_linear_drag(2) * 20.0 - weight).abs() < 1e-9 * weight);
        scale.mass = 25.0;
        scale.speed = 0.2;
        for axis in 0..6 {
            let frame = OPEN_FRAME * scale.quadratic_drag(axis);
            assert_eq!(scale.expected_quadratic_drag(axis), frame);
            let linear = OPEN_FRAME * scale.linear_drag(axis);
            assert!((scale.expected_linear_drag(axis) - linear).abs() < 1e-12 * linear);
        }
    }

    /// A sphere is expected to have its displaced mass; a slender hull the least share along itself and nearly twice its displaced
    /// mass across; a plate broadside on many times that.
    #[test]
    fn added_mass_is_expected_where_the_hull_is_broad() {
        let mut scale = fixture::body_scale(&fixture::still());
        let displaced = scale.displaced();
        let mut shares = |extent: [f64; 3]| {
            scale.extent = extent;
            [0, 1, 2].map(|axis| scale.expected_added_mass(axis) / displaced)
        };
        for share in shares([0.4, 0.4, 0.4]) {
            assert!((share - 1.0).abs() < 1e-6, "{share}");
        }
        let [surge, sway, heave] = shares([1.8, 0.21, 0.21]);
        assert_eq!(surge, super::LEAST_STIRRED);
        assert!((1.8..2.0).contains(&sway) && (sway - heave).abs() < 1e-9);
        let [edge, _, broadside] = shares([1.0, 1.0, 0.05]);
        assert!(edge < 0.3 && broadside > 10.0, "{edge} {broadside}");
        scale.extent = [1.0, 1.0, 1e-3];
        let thin = effect(Id::AddedMass).parameters(&Target::Body(scale));
        assert!(thin.iter().all(|p| p.prior_sd <= p.upper));
    }
}
