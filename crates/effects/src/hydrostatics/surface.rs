//! Triangles of a shape's surface.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector3;

use super::shape::Shape;

/// Fewest sides of a circle.
const FEWEST_SIDES: usize = 12;

/// A closed surface in the shape's frame: vertices [m], and faces with corners counterclockwise from outside. It has the
/// symmetries of a brick that the shape has.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    pub(super) vertices: Vec<Vector3<f64>>,
    pub(super) faces: Vec<[u32; 3]>,
}

impl Surface {
    /// The surface in triangles with edges of about `length` [m] at most. Round shapes are scaled, across the axis if they
    /// have one, so that the surface encloses the shape's volume.
    pub(super) fn new(shape: &Shape, length: f64) -> Self {
        let mut surface = match shape {
            Shape::Sphere { radius } => Self::ellipsoid(&Vector3::from_element(*radius), length),
            Shape::Ellipsoid { semi_axes } => Self::ellipsoid(&Vector3::from(*semi_axes), length),
            Shape::Box { half } => return Self::cuboid(&Vector3::from(*half), length),
            Shape::Cylinder {
                radius,
                half_length,
            } => Self::cylinder(*radius, *half_length, length),
            Shape::Capsule {
                radius,
                half_length,
            } => Self::capsule(*radius, *half_length, length),
            Shape::Mesh(mesh) => {
                let vertices: Vec<_> = mesh.vertices().collect();
                return Self::split(&vertices, mesh.faces(), length);
            }
        };
        let ratio = shape.whole().volume / surface.volume();
        let scale = match shape {
            Shape::Sphere { .. } | Shape::Ellipsoid { .. } => Vector3::from_element(ratio.cbrt()),
            _ => Vector3::new(ratio.sqrt(), ratio.sqrt(), 1.0),
        };
        if scale.iter().all(|scale| scale.is_finite()) {
            for vertex in &mut surface.vertices {
                vertex.component_mul_assign(&scale);
            }
        }
        surface
    }

    fn volume(&self) -> f64 {
        let cones = self.faces.iter().map(|face| {
            let [a, b, c] = face.map(|corner| self.vertices[corner as usize]);
            a.dot(&b.cross(&c)) / 6.0
        });
        cones.sum()
    }

    fn vertex(&mut self, vertex: Vector3<f64>) -> u32 {
        self.vertices.push(vertex);
        self.vertices.len() as u32 - 1
    }

    /// An octahedron's faces in `n^2` triangles each, drawn out to the ellipsoid.
    fn ellipsoid(semi_axes: &Vector3<f64>, length: f64) -> Self {
        let n = pieces(FRAC_PI_2 * semi_axes.max(), length).max(FEWEST_SIDES / 4);
        let mut surface = Self::default();
        for octant in 0..8 {
            let signs =
                Vector3::from_fn(|axis, _| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 });
            let outwards = signs.product() > 0.0;
            surface.triangle(n, outwards, |i, j| {
                // Angles, and not places on the flat face, are split evenly.
                let along = [n - i - j, i, j].map(|k| (FRAC_PI_2 * k as f64 / n as f64).sin());
                let unit = Vector3::from(along).normalize();
                unit.component_mul(&signs).component_mul(semi_axes)
            });
        }
        surface
    }

    /// A triangle in `n^2` triangles; `place(i, j)` is the place at `i` and `j` of `n` parts along two of its edges.
    fn triangle(&mut self, n: usize, forward: bool, place: impl Fn(usize, usize) -> Vector3<f64>) {
        let mut before: Vec<u32> = Vec::new();
        for i in 0..=n {
            // Row i runs over j; it is shorter than the row before by one.
            let row: Vec<u32> = (0..=n - i).map(|j| self.vertex(place(i, j))).collect();
            for j in 0..before.len().saturating_sub(1) {
                self.face([before[j], row[j], before[j + 1]], forward);
                if j + 1 < row.len() {
                    self.face([row[j], row[j + 1], before[j + 1]], forward);
                }
            }
            before = row;
        }
    }

    fn face(&mut self, [a, b, c]: [u32; 3], forward: bool) {
        self.faces.push(if forward { [a, b, c] } else { [a, c, b] });
    }

    fn cuboid(half: &Vector3<f64>, length: f64) -> Self {
        let mut surface = Self::default();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let [nu, nv] = [u, v].map(|k| 2 * pieces(half[k], length));
            for side in [1.0, -1.0] {
                surface.grid(nu, nv, side > 0.0, |i, j| {
                    let mut at = Vector3::zeros();
                    at[axis] = side * half[axis];
                    at[u] = half[u] * (2.0 * i as f64 / nu as f64 - 1.0);
                    at[v] = half[v] * (2.0 * j as f64 / nv as f64 - 1.0);
                    at
                });
            }
        }
        surface
    }

    /// A patch in `nu nv` quadrilaterals, each in two triangles.
    fn grid(
        &mut self,
        nu: usize,
        nv: usize,
        forward: bool,
        place: impl Fn(usize, usize) -> Vector3<f64>,
    ) {
        let first = self.vertices.len();
        for i in 0..=nu {
            for j in 0..=nv {
                self.vertex(place(i, j));
            }
        }
        let number = |i: usize, j: usize| (first + i * (nv + 1) + j) as u32;
        for i in 0..nu {
            for j in 0..nv {
                let corners = [
                    number(i, j),
                    number(i + 1, j),
                    number(i + 1, j + 1),
                    number(i, j + 1),
                ];
                self.quadrilateral(corners, (2 * i < nu) == (2 * j < nv), forward);
            }
        }
    }

    /// Two triangles with corner 0 in common, or with corner 1. The halves of a symmetric shape mirror each other if they
    /// are split the other way.
    fn quadrilateral(&mut self, [a, b, c, d]: [u32; 4], from_first: bool, forward: bool) {
        let triangles = if from_first {
            [[a, b, c], [a, c, d]]
        } else {
            [[b, c, d], [b, d, a]]
        };
        for triangle in triangles {
            if triangle[0] != triangle[1]
                && triangle[1] != triangle[2]
                && triangle[2] != triangle[0]
            {
                self.face(triangle, forward);
            }
        }
    }

    fn cylinder(radius: f64, half_length: f64, length: f64) -> Self {
        let (rings, sides) = (pieces(radius, length), 2 * pieces(half_length, length));
        let part = |k: usize, n: usize| k as f64 / n as f64;
        let lower = (0..rings).map(|k| [radius * part(k, rings), -half_length]);
        let wall = (0..=sides).map(|k| [radius, half_length * (2.0 * part(k, sides) - 1.0)]);
        let upper = (0..rings)
            .rev()
            .map(|k| [radius * part(k, rings), half_length]);
        Self::turned(&lower.chain(wall).chain(upper).collect::<Vec<_>>(), length)
    }

    fn capsule(radius: f64, half_length: f64, length: f64) -> Self {
        let rings = pieces(FRAC_PI_2 * radius, length).max(FEWEST_SIDES / 4);
        let sides = 2 * pieces(half_length, length);
        let arc = |k: usize| {
            let angle = FRAC_PI_2 * k as f64 / rings as f64;
            [radius * angle.sin(), radius * angle.cos()]
        };
        // Half a polygon's turn is less than a half ball: its ends are drawn out to the same volume.
        let frusta = (0..rings).map(|k| {
            let ([a, upper], [b, lower]) = (arc(k), arc(k + 1));
            (upper - lower) * (a * a + a * b + b * b) / 3.0
        });
        let stretch = 2.0 / 3.0 * radius.powi(3) / frusta.sum::<f64>();
        let arc = |k: usize| {
            let [radius, height] = arc(k);
            [radius, half_length + stretch * height]
        };
        let lower = (0..rings).map(|k| {
            let [radius, z] = arc(k);
            [radius, -z]
        });
        let wall =
            (0..=sides).map(|k| [radius, half_length * (2.0 * k as f64 / sides as f64 - 1.0)]);
        let upper = (0..rings).rev().map(arc);
        Self::turned(&lower.chain(wall).chain(upper).collect::<Vec<_>>(), length)
    }

    /// A profile of radii and heights, from the lower pole to the upper one, turned about z.
    fn turned(profile: &[[f64; 2]], length: f64) -> Self {
        let widest = profile
            .iter()
            .map(|[radius, _]| *radius)
            .fold(0.0, f64::max);
        let n = 4 * pieces(FRAC_PI_2 * widest, length).max(FEWEST_SIDES / 4);
        let mut surface = Self::default();
        let rings: Vec<Vec<u32>> = profile
            .iter()
            .enumerate()
            .map(|(at, [radius, z])| {
                if at == 0 || at + 1 == profile.len() {
                    return vec![surface.vertex(Vector3::new(0.0, 0.0, *z)); n];
                }
                (0..n)
                    .map(|k| {
                        let angle = TAU * k as f64 / n as f64;
                        surface.vertex(Vector3::new(radius * angle.cos(), radius * angle.sin(), *z))
                    })
                    .collect()
            })
            .collect();
        for (ring, (lower, upper)) in rings.iter().zip(&rings[1..]).enumerate() {
            for k in 0..n {
                let next = (k + 1) % n;
                let corners = [lower[k], lower[next], upper[next], upper[k]];
                let quarter = 4 * k / n;
                surface.quadrilateral(
                    corners,
                    quarter.is_multiple_of(2) == (2 * ring + 2 < rings.len()),
                    true,
                );
            }
        }
        surface
    }

    fn split(
        vertices: &[Vector3<f64>],
        faces: impl Iterator<Item = [u32; 3]>,
        length: f64,
    ) -> Self {
        let mut surface = Self {
            vertices: vertices.to_vec(),
            faces: Vec::new(),
        };
        for face in faces {
            let [a, b, c] = face.map(|corner| vertices[corner as usize]);
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            match pieces(longest, length) {
                1 => surface.faces.push(face),
                n => surface.triangle(n, true, |i, j| {
                    a + (b - a) * (i as f64 / n as f64) + (c - a) * (j as f64 / n as f64)
                }),
            }
        }
        surface
    }
}

/// Pieces of at most `length` that a whole makes; one if either is not a number.
fn pieces(whole: f64, length: f64) -> usize {
    const MOST: f64 = 1024.0;
    // A whole that is longer than a piece by rounding alone is one.
    let pieces = (whole / length * (1.0 - 1e-9)).ceil();
    if pieces > 1.0 {
        pieces.min(MOST) as usize
    } else {
        1
    }
}
