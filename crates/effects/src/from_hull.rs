//! First values of a body's water from the shape of its hull alone.
//!
//! Buoyancy is the hull's; added mass is that of the ellipsoid of its extents in an ideal fluid (H. Lamb, Hydrodynamics, 6th
//! ed. 1932, articles 114 and 115), times the mass that the hull displaces; drag is that of its silhouettes with one
//! coefficient, in strips for a rotation (S. F. Hoerner, Fluid-Dynamic Drag, 1965, chapter 3). Drag is good to a factor of two:
//! the coefficient of a streamlined body along its axis is a tenth of a box's.

use nalgebra::Vector3;

use crate::{
    EffectSet, Entry, Id, SetError, catalogue::ellipsoid, fossen::OneBody, hydrostatics::Hull,
};

/// Points along each axis of the box about a hull that show its silhouettes.
const POINTS: usize = 48;

/// A hull, and the water about it.
#[derive(Clone, Debug)]
pub struct HullInWater<'a> {
    /// The hull, body frame.
    pub hull: &'a Hull,
    /// Middle of its box, body frame [m].
    pub middle: [f64; 3],
    /// Extents of its box [m].
    pub extent: [f64; 3],
    /// Density of the water [kg/m^3].
    pub density: f64,
    /// Drag coefficient for the area of a silhouette [1].
    pub drag_coefficient: f64,
}

impl HullInWater<'_> {
    /// Hydrostatics, added mass and quadratic drag of a body of that name: the text of an `effects.json`.
    ///
    /// # Errors
    /// A value that no file can have: of a hull without volume, or of sizes that are not finite.
    pub fn to_json(&self, target: &str) -> Result<String, SetError> {
        let entry = |effect, parameters| Entry {
            effect,
            target: target.to_owned(),
            parameters,
        };
        let entries = vec![
            entry(Id::Hydrostatics, vec![self.hull.volume()]),
            entry(Id::AddedMass, self.added_mass().map(rounded).to_vec()),
            entry(
                Id::QuadraticDrag,
                self.quadratic_drag().map(rounded).to_vec(),
            ),
        ];
        EffectSet { entries }.to_json(&OneBody(target))
    }

    /// Added mass [kg] and added moment of inertia [kg m^2].
    fn added_mass(&self) -> [f64; 6] {
        let displaced = self.density * self.hull.volume();
        let (mass, inertia) = ellipsoid::added_mass(self.extent);
        let [x, y, z] = mass.map(|share| share * displaced);
        let [roll, pitch, yaw] = inertia.map(|per_mass| per_mass * displaced);
        [x, y, z, roll, pitch, yaw]
    }

    /// Quadratic drag [N s^2/m^2, N m s^2/rad^2].
    fn quadratic_drag(&self) -> [f64; 6] {
        let pressure = 0.5 * self.density * self.drag_coefficient;
        let silhouettes = [0, 1, 2].map(|axis| self.silhouette(axis));
        let area = |axis: usize| silhouettes[axis].iter().map(|(_, area)| area).sum::<f64>();
        // Turning about an axis moves a point at the distance r along a second one across the third.
        let strips = |about: usize| {
            let (one, other) = ((about + 1) % 3, (about + 2) % 3);
            let cubes = |across: usize, along: usize| {
                let strips = silhouettes[across].iter();
                strips
                    .map(|(at, area)| at[along].abs().powi(3) * area)
                    .sum::<f64>()
            };
            cubes(one, other) + cubes(other, one)
        };
        [area(0), area(1), area(2), strips(0), strips(1), strips(2)].map(|size| pressure * size)
    }

    /// Silhouette along an axis: points relative to the middle [m], and the area that each stands for [m^2].
    fn silhouette(&self, axis: usize) -> Vec<(Vector3<f64>, f64)> {
        let (one, other) = ((axis + 1) % 3, (axis + 2) % 3);
        let step = Vector3::from(self.extent) / POINTS as f64;
        let at =
            |axis: usize, index: usize| (index as f64 + 0.5) * step[axis] - 0.5 * self.extent[axis];
        let mut seen = Vec::new();
        for index in 0..POINTS * POINTS {
            let mut point = Vector3::zeros();
            point[one] = at(one, index % POINTS);
            point[other] = at(other, index / POINTS);
            let is_seen = (0..POINTS).any(|depth| {
                point[axis] = at(axis, depth);
                let point = point + Vector3::from(self.middle);
                self.hull
                    .solids()
                    .iter()
                    .any(|solid| solid.contains(&point))
            });
            if is_seen {
                seen.push((point, step[one] * step[other]));
            }
        }
        seen
    }
}

/// Three digits: more would say that they are known.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::hydrostatics::{Shape, Solid};

    fn hull(shape: Shape) -> Hull {
        let place = Isometry3::translation(0.2, 0.0, -0.1);
        Hull::new(vec![Solid { shape, place }])
    }

    fn of(hull: &Hull, extent: [f64; 3]) -> HullInWater<'_> {
        HullInWater {
            hull,
            middle: [0.2, 0.0, -0.1],
            extent,
            density: 1000.0,
            drag_coefficient: 0.8,
        }
    }

    #[test]
    fn a_ball_has_half_its_displaced_mass_and_a_disc_for_a_silhouette() {
        let ball = hull(Shape::Sphere { radius: 0.25 });
        let ball = of(&ball, [0.5; 3]);
        let displaced = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.25_f64.powi(3);
        let disc = std::f64::consts::PI * 0.25 * 0.25;
        for axis in 0..3 {
            assert!((ball.added_mass()[axis] - 0.5 * displaced).abs() < 1e-6 * displaced);
            assert!((ball.quadratic_drag()[axis] / (0.5 * 1000.0 * 0.8 * disc) - 1.0).abs() < 0.01);
        }
    }

    /// A box: sides, and strips of |r|^3.
    #[test]
    fn a_box_drags_by_its_sides_and_turns_by_its_strips() {
        let cuboid = hull(Shape::Box {
            half: [0.5, 0.3, 0.2],
        });
        let drag = of(&cuboid, [1.0, 0.6, 0.4]).quadratic_drag();
        let strip = |length: f64, breadth: f64| breadth * 2.0 * (0.5 * length).powi(4) / 4.0;
        let expected = [
            0.24,
            0.4,
            0.6,
            strip(0.6, 1.0) + strip(0.4, 1.0),
            strip(1.0, 0.6) + strip(0.4, 0.6),
            strip(1.0, 0.4) + strip(0.6, 0.4),
        ];
        for (found, expected) in drag.into_iter().zip(expected) {
            assert!(
                (found / (400.0 * expected) - 1.0).abs() < 2e-3,
                "{found} {expected}"
            );
        }
    }

    #[test]
    fn the_file_is_read_back() {
        let cuboid = hull(Shape::Box {
            half: [0.5, 0.3, 0.2],
        });
        let text = of(&cuboid, [1.0, 0.6, 0.4]).to_json("rov").expect("a file");
        let set = EffectSet::parse(&text, &OneBody("rov")).expect("it is read");
        assert_eq!(set.entries.len(), 3);
        assert_eq!(set.entries[0].parameters, [cuboid.volume()]);
    }
}
