//! Whether two solids share space, by counting points.

use nalgebra::Vector3;

use super::solid::Solid;

/// Points in the smaller solid's bounding box.
const POINTS: usize = 4096;
/// Points in the box that two hulls both reach into.
const POINTS_IN_BOTH: usize = 4 * POINTS;
/// Share of the smaller solid's points that lie in the other, above which the two overlap.
const SHARE: f64 = 0.0075;

/// Whether two solids share more than [`SHARE`] of the smaller one.
pub(super) fn share_space(one: &Solid, other: &Solid) -> bool {
    let between = other.place.translation.vector - one.place.translation.vector;
    let radii = one.shape.bounding_radius() + other.shape.bounding_radius();
    if between.norm() >= radii || apart(one, other) {
        return false;
    }
    let (small, large) = if one.whole().volume <= other.whole().volume {
        (one, other)
    } else {
        (other, one)
    };
    let reach = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| small.shape.reach(&axis));
    let (mut inside, mut shared) = (0_usize, 0_usize);
    for point in points_in(reach, POINTS) {
        if small.shape.contains(&point) {
            inside += 1;
            let there = small.place * nalgebra::Point3::from(point);
            shared += usize::from(large.contains(&there.coords));
        }
    }
    shared as f64 > SHARE * inside as f64
}

/// Volume [m^3] that is in both of two groups of solids, by counting points of a box (least and greatest coordinate by axis).
pub(super) fn shared_volume(one: &[Solid], other: &[Solid], box_: [(f64, f64); 3]) -> f64 {
    let within =
        |solids: &[Solid], point: &Vector3<f64>| solids.iter().any(|solid| solid.contains(point));
    let shared =
        points_in(box_, POINTS_IN_BOTH).filter(|point| within(one, point) && within(other, point));
    let size: f64 = box_.iter().map(|(low, high)| high - low).product();
    size * shared.count() as f64 / POINTS_IN_BOTH as f64
}

/// Whether a plane across an axis of either solid, or across the line between their origins, keeps them apart.
fn apart(one: &Solid, other: &Solid) -> bool {
    let axes = [one, other].into_iter().flat_map(|solid| {
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| solid.place.rotation * axis)
    });
    let between = other.place.translation.vector - one.place.translation.vector;
    axes.chain(between.try_normalize(0.0)).any(|direction| {
        let (a, b) = (one.reach(&direction), other.reach(&direction));
        a.1 <= b.0 || b.1 <= a.0
    })
}

/// Points that fill a box evenly.
fn points_in(box_: [(f64, f64); 3], count: usize) -> impl Iterator<Item = Vector3<f64>> {
    evenly_spread(count).map(move |point| {
        Vector3::from_fn(|axis, _| {
            let (low, high) = box_[axis];
            low + (high - low) * point[axis]
        })
    })
}

/// Points of the unit cube that fill it evenly: the additive recurrence of M. Roberts (2018), on the root of
/// `x^4 = x + 1`.
fn evenly_spread(count: usize) -> impl Iterator<Item = [f64; 3]> {
    const ROOT: f64 = 1.220_744_084_605_759_5;
    let steps = [1.0 / ROOT, 1.0 / (ROOT * ROOT), 1.0 / (ROOT * ROOT * ROOT)];
    (1..=count).map(move |n| steps.map(|step| (0.5 + step * n as f64).fract()))
}
