//! Pressure on the panels of a hull below a surface that is not a plane over it.

use std::{cell::Cell, fmt};

use nalgebra::{Isometry3, Vector3};

use super::{edges, hull::Hull, part::Part, surface::Surface};

/// Most panels along a hull.
const FINEST: usize = 256;

thread_local! {
    /// The vertices of a call: a buffer, so that a step allocates nothing.
    static POINTS: Cell<Vec<Point>> = const { Cell::new(Vec::new()) };
}

/// A vertex or a place where the water's surface cuts an edge.
#[derive(Clone, Copy, Debug)]
struct Point {
    /// From the body's origin, axes of the world [m].
    at: Vector3<f64>,
    /// Depth under the water's surface [m], positive in water.
    depth: f64,
    /// Pressure over density [m^2/s^2]; zero in air.
    pressure: f64,
}

/// A hull's surface in triangles, body frame.
#[derive(Clone)]
pub struct Panels {
    vertices: Vec<Vector3<f64>>,
    faces: Vec<[u32; 3]>,
    /// Outward normal of each face, as long as its area [m^2].
    areas: Vec<Vector3<f64>>,
}

/// Their number: they follow from the hull.
impl fmt::Debug for Panels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Panels")
            .field("faces", &self.faces.len())
            .finish_non_exhaustive()
    }
}

/// Integrals over wet panels, from the body's origin in axes of the world.
#[derive(Default)]
struct Sum {
    force: Vector3<f64>,
    torque: Vector3<f64>,
    wet: Part,
}

impl Sum {
    /// Adds a wet triangle over which place, depth and pressure are linear: exact for their products of two, and for the
    /// squared depth times the normal.
    fn add(&mut self, area: &Vector3<f64>, corners: [&Point; 3]) {
        let total = |of: fn(&Point) -> f64| corners.iter().map(|point| of(point)).sum::<f64>();
        let places: Vector3<f64> = corners.iter().map(|point| point.at).sum();
        let (pressures, depths) = (total(|point| point.pressure), total(|point| point.depth));
        // Mean of place times a value that is linear too, times twelve.
        let weighted = |values: f64, of: fn(&Point) -> f64| {
            corners
                .iter()
                .fold(places * values, |sum, point| sum + point.at * of(point))
        };
        self.force -= area * (pressures / 3.0);
        self.torque -= weighted(pressures, |point| point.pressure).cross(area) / 12.0;
        // Divergence theorem, with fields along z that vanish on the water's surface.
        let mut moment = weighted(depths, |point| point.depth);
        let squares = depths * depths + total(|point| point.depth * point.depth);
        moment.z += 0.5 * squares;
        self.wet.volume -= area.z * depths / 3.0;
        self.wet.moment -= moment * (area.z / 12.0);
    }
}

impl Panels {
    /// A hull's surface in panels with edges of about its longest extent along an axis over `fineness`, 1 to 256, or
    /// shorter. Round shapes are polyhedra of the same volume, so that a deep hull's buoyancy is exact; solids that overlap
    /// are counted twice.
    ///
    /// Under a flat surface, force, torque and wet part are exact for boxes and meshes; for a round shape with `n` panels
    /// round it, 12 at least, they err by less than `1 / n^2` of its volume.
    pub fn new(hull: &Hull, fineness: usize) -> Self {
        let extent = [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|axis| hull.reach(&axis))
            .into_iter()
            .fold(0.0_f64, |longest, (low, high)| longest.max(high - low));
        let length = if extent > 0.0 && extent.is_finite() {
            extent / fineness.clamp(1, FINEST) as f64
        } else {
            f64::INFINITY
        };

        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for solid in hull.solids() {
            let surface = Surface::new(&solid.shape, length);
            let first = merged(&surface.vertices, &mut vertices, |vertex| {
                (solid.place * nalgebra::Point3::from(*vertex)).coords
            });
            faces.extend(
                surface
                    .faces
                    .iter()
                    .map(|face| face.map(|corner| first[corner as usize])),
            );
        }
        let areas = faces
            .iter()
            .map(|face| {
                let [a, b, c]: [Vector3<f64>; 3] = face.map(|corner| vertices[corner as usize]);
                0.5 * (b - a).cross(&(c - a))
            })
            .collect();
        Self {
            vertices,
            faces,
            areas,
        }
    }

    /// Number of panels.
    pub fn count(&self) -> usize {
        self.faces.len()
    }

    /// Force [m^4/s^2] and torque about the body's origin [m^5/s^2] of the water's pressure, over the water's density, and
    /// the wet part of the hull; all in the body's frame. The force is the integral of `-pressure n` over the wet surface.
    ///
    /// `elevation` takes a point of the world to the z [m] of the water's surface above or below it, and is called once a
    /// vertex. `pressure` takes a point of the world to pressure over density [m^2/s^2], zero in air, and is called at wet
    /// vertices and where the surface cuts an edge. Both are taken to be linear within a panel.
    pub fn push(
        &self,
        world_from_body: &Isometry3<f64>,
        elevation: impl Fn(Vector3<f64>) -> f64,
        pressure: impl Fn(Vector3<f64>) -> f64,
    ) -> ([f64; 6], Part) {
        let origin = world_from_body.translation.vector;
        let rotation = world_from_body.rotation.to_rotation_matrix();
        let mut points = POINTS.take();
        points.clear();
        points.extend(self.vertices.iter().map(|vertex| {
            let at = rotation * vertex;
            let place = origin + at;
            let depth = elevation(place) - place.z;
            let pressure = if depth <= 0.0 {
                0.0
            } else if depth.is_nan() {
                depth
            } else {
                pressure(place)
            };
            Point {
                at,
                depth,
                pressure,
            }
        }));
        let on_edge = |wet: &Point, dry: &Point| {
            let at = wet.at + (dry.at - wet.at) * (wet.depth / (wet.depth - dry.depth));
            Point {
                at,
                depth: 0.0,
                pressure: pressure(origin + at),
            }
        };
        let mut sum = Sum::default();
        for (face, area) in self.faces.iter().zip(&self.areas) {
            let corners = face.map(|corner| &points[corner as usize]);
            add_wet(&mut sum, &(rotation * area), corners, on_edge);
        }
        POINTS.set(points);
        let back = |vector: Vector3<f64>| rotation.inverse_transform_vector(&vector);
        let (force, torque) = (back(sum.force), back(sum.torque));
        let wet = Part {
            volume: sum.wet.volume,
            moment: back(sum.wet.moment),
        };
        (
            [force.x, force.y, force.z, torque.x, torque.y, torque.z],
            wet,
        )
    }
}

/// Adds the wet part of a panel; `on_edge` makes the point between a wet and a dry one where the surface is.
fn add_wet(
    sum: &mut Sum,
    area: &Vector3<f64>,
    corners: [&Point; 3],
    on_edge: impl Fn(&Point, &Point) -> Point,
) {
    let dry = corners.map(|point| point.depth <= 0.0);
    let count = dry.iter().filter(|dry| **dry).count();
    if count == 0 {
        return sum.add(area, corners);
    }
    if count == 3 {
        return;
    }
    // The corner that is alone on its side of the surface, and the others in turn.
    let alone = (0..3).find(|&k| dry[k] == (count == 1)).unwrap_or_default();
    let [a, b, c] = [0, 1, 2].map(|k| corners[(alone + k) % 3]);
    if count == 2 {
        let (ab, ac) = (on_edge(a, b), on_edge(a, c));
        let share = a.depth / (a.depth - b.depth) * (a.depth / (a.depth - c.depth));
        sum.add(&(area * share), [a, &ab, &ac]);
    } else {
        let (ab, ac) = (on_edge(b, a), on_edge(c, a));
        let (to_b, to_c) = (b.depth / (b.depth - a.depth), c.depth / (c.depth - a.depth));
        // The quadrilateral b, c, ac, ab, half of it split along each diagonal: no corner is preferred.
        for (share, corners) in [
            (to_c, [b, c, &ac]),
            (to_b * (1.0 - to_c), [b, &ac, &ab]),
            (to_b, [b, c, &ab]),
            (to_c * (1.0 - to_b), [c, &ac, &ab]),
        ] {
            sum.add(&(area * (0.5 * share)), corners);
        }
    }
}

/// Appends the vertices, each place once and mapped, and tells the number of each.
fn merged(
    vertices: &[Vector3<f64>],
    out: &mut Vec<Vector3<f64>>,
    map: impl Fn(&Vector3<f64>) -> Vector3<f64>,
) -> Vec<u32> {
    let places: Vec<[f64; 3]> = vertices.iter().map(|vertex| (*vertex).into()).collect();
    let first = edges::weld(&places);
    let mut number: Vec<u32> = Vec::with_capacity(first.len());
    for (index, first) in first.iter().enumerate() {
        if *first as usize == index {
            number.push(out.len() as u32);
            out.push(map(&vertices[index]));
        } else {
            number.push(number[*first as usize]);
        }
    }
    number
}
