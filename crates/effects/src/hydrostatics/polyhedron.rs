//! Closed surfaces of triangles below a plane, and the box.
//!
//! The wet parts of the triangles, each joined to one point on the plane, make signed tetrahedra that sum to the wet
//! volume; the cut face adds nothing, for that point lies in it. Exact for any closed surface, convex or not.

use std::ops::Add;

use nalgebra::{Matrix3, Vector3};

use super::{
    box_tree::{BoxTree, Wet},
    part::Part,
};

/// A triangle of a closed surface, its corners counterclockwise from outside.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Indices of the corners.
    pub(super) corners: [u32; 3],
    /// Outward normal, as long as twice the area [m^2].
    pub(super) normal: Vector3<f64>,
    /// Normal times a corner [m^3].
    pub(super) offset: f64,
}

impl Facet {
    pub(super) fn new(corners: [u32; 3], vertices: &[Vector3<f64>]) -> Self {
        let [a, b, c] = corners.map(|corner| vertices[corner as usize]);
        let normal = (b - a).cross(&(c - a));
        Self {
            corners,
            normal,
            offset: normal.dot(&a),
        }
    }

    /// Places of the corners [m].
    pub(super) fn places(&self, vertices: &[Vector3<f64>]) -> [Vector3<f64>; 3] {
        self.corners.map(|corner| vertices[corner as usize])
    }
}

/// Sum of tetrahedra from an apex.
struct Tetrahedra {
    apex: Vector3<f64>,
    /// Six times the volume [m^3].
    six_volumes: f64,
    /// Sum of each one's six volumes times its three outer corners [m^4].
    weighted: Vector3<f64>,
}

impl Tetrahedra {
    fn new(apex: Vector3<f64>) -> Self {
        Self {
            apex,
            six_volumes: 0.0,
            weighted: Vector3::zeros(),
        }
    }

    #[inline]
    fn add(&mut self, six_volumes: f64, corners: Vector3<f64>) {
        self.six_volumes += six_volumes;
        self.weighted += six_volumes * corners;
    }

    /// The facets of some sums, whole.
    fn add_all(&mut self, of: &Sums) {
        self.six_volumes += of.offset - of.normal.dot(&self.apex);
        self.weighted += of.by_offset - of.by_normal * self.apex;
    }

    /// The part of a facet at a height of zero or less.
    #[inline]
    fn add_wet(
        &mut self,
        normal: &Vector3<f64>,
        offset: f64,
        corners: [&Vector3<f64>; 3],
        heights: [f64; 3],
    ) {
        let wet = heights.map(|height| height <= 0.0);
        let count = wet.iter().filter(|wet| **wet).count();
        if count == 0 {
            return;
        }
        let six_volumes = offset - normal.dot(&self.apex);
        let sum = || corners[0] + corners[1] + corners[2];
        if count == 3 {
            self.add(six_volumes, sum());
            return;
        }
        // The corner that is alone on its side, and the triangle that the plane cuts off at it.
        let alone =
            usize::from(wet[0] == wet[1]) * 2 + usize::from(wet[0] != wet[1] && wet[0] == wet[2]);
        let (b, c) = ((alone + 1) % 3, (alone + 2) % 3);
        let to_b = heights[alone] / (heights[alone] - heights[b]);
        let to_c = heights[alone] / (heights[alone] - heights[c]);
        let share = to_b * to_c;
        let a = corners[alone];
        let cut = 3.0 * a + to_b * (corners[b] - a) + to_c * (corners[c] - a);
        if count == 1 {
            self.add(share * six_volumes, cut);
        } else {
            self.add(six_volumes, sum());
            self.add(-share * six_volumes, cut);
        }
    }

    fn part(self) -> Part {
        Part {
            volume: self.six_volumes / 6.0,
            moment: (self.weighted + self.six_volumes * self.apex) / 24.0,
        }
    }
}

/// Sums over some facets, from which their tetrahedra from any apex follow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    /// Sum of the normals.
    normal: Vector3<f64>,
    /// Sum of the offsets.
    offset: f64,
    /// Sums of the facets' added corners, each times its facet's offset, and times its facet's normal.
    by_offset: Vector3<f64>,
    by_normal: Matrix3<f64>,
}

impl Sums {
    pub(super) fn of(facet: &Facet, vertices: &[Vector3<f64>]) -> Self {
        let [a, b, c] = facet.places(vertices);
        let corners = a + b + c;
        Self {
            normal: facet.normal,
            offset: facet.offset,
            by_offset: facet.offset * corners,
            by_normal: corners * facet.normal.transpose(),
        }
    }
}

impl Add for Sums {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            normal: self.normal + other.normal,
            offset: self.offset + other.offset,
            by_offset: self.by_offset + other.by_offset,
            by_normal: self.by_normal + other.by_normal,
        }
    }
}

/// The part of a closed surface below a plane: subtrees under the plane by their sums, of facets those that it cuts.
/// `sums`: of each node of the tree.
pub(super) fn below(
    vertices: &[Vector3<f64>],
    facets: &[Facet],
    (tree, sums): (&BoxTree, &[Sums]),
    up: &Vector3<f64>,
    level: f64,
) -> Part {
    let mut sum = Tetrahedra::new(up * level);
    tree.below(up, level, |wet| match wet {
        Wet::Subtree(node) => sum.add_all(&sums[node]),
        Wet::Triangle(facet) => {
            let facet = &facets[facet];
            let corners = facet.corners.map(|corner| &vertices[corner as usize]);
            let heights = corners.map(|corner| up.dot(corner) - level);
            sum.add_wet(&facet.normal, facet.offset, corners, heights);
        }
    });
    sum.part()
}

/// The whole of a closed surface.
pub(super) fn whole(vertices: &[Vector3<f64>], facets: &[Facet]) -> Part {
    let mut sum = Tetrahedra::new(Vector3::zeros());
    for facet in facets {
        let [a, b, c] = facet.places(vertices);
        sum.add(facet.offset, a + b + c);
    }
    sum.part()
}

/// Volume of a box [m^3].
pub(super) fn box_volume(half: &Vector3<f64>) -> f64 {
    8.0 * half.product()
}

/// Triangles of the box's face towards +axis and -axis; bit `k` of a corner's number is set where its coordinate `k` is
/// positive.
const BOX_FACES: [[[[usize; 3]; 2]; 2]; 3] = [
    [[[1, 3, 7], [1, 7, 5]], [[0, 4, 6], [0, 6, 2]]],
    [[[2, 6, 7], [2, 7, 3]], [[0, 1, 5], [0, 5, 4]]],
    [[[4, 5, 7], [4, 7, 6]], [[0, 2, 3], [0, 3, 1]]],
];

/// The part of a box below a plane that cuts the four edges along one axis and no others: a column under a slope. None where it
/// cuts others.
fn column_below(half: &Vector3<f64>, up: &Vector3<f64>, level: f64) -> Option<Part> {
    let axis = up.iamax();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let inverse = up[axis].recip();
    let middle = level * inverse;
    // Rise of the plane from the middle to the sides.
    let rise = [-up[i] * inverse * half[i], -up[j] * inverse * half[j]];
    let reach = middle.abs() + rise[0].abs() + rise[1].abs();
    if reach.is_nan() || reach > half[axis] {
        return None;
    }
    let area = 4.0 * half[i] * half[j];
    let signed_area = area.copysign(up[axis]);
    let square = middle * middle + (rise[0] * rise[0] + rise[1] * rise[1]) / 3.0;
    let mut moment = Vector3::zeros();
    moment[i] = signed_area * rise[0] * half[i] / 3.0;
    moment[j] = signed_area * rise[1] * half[j] / 3.0;
    moment[axis] = 0.5 * signed_area * (square - half[axis] * half[axis]);
    Some(Part {
        volume: area * half[axis] + signed_area * middle,
        moment,
    })
}

/// The part of a box below a plane.
pub(super) fn box_below(half: &Vector3<f64>, up: &Vector3<f64>, level: f64) -> Part {
    if let Some(part) = column_below(half, up, level) {
        return part;
    }
    let corners: [Vector3<f64>; 8] = std::array::from_fn(|corner| {
        Vector3::from_fn(|axis, _| {
            if corner >> axis & 1 == 1 {
                half[axis]
            } else {
                -half[axis]
            }
        })
    });
    let heights = corners.map(|corner| up.dot(&corner) - level);
    let offset = 4.0 * half.product();
    let mut sum = Tetrahedra::new(up * level);
    for (axis, sides) in BOX_FACES.iter().enumerate() {
        let mut normal = Vector3::zeros();
        normal[axis] = 4.0 * half[(axis + 1) % 3] * half[(axis + 2) % 3];
        for (triangles, normal) in sides.iter().zip([normal, -normal]) {
            for triangle in triangles {
                sum.add_wet(
                    &normal,
                    offset,
                    triangle.map(|corner| &corners[corner]),
                    triangle.map(|corner| heights[corner]),
                );
            }
        }
    }
    sum.part()
}
