//! The range of the training data, and the limits that hold a simulation to it.
//!
//! Outside its training data a network need not obey physics: its drag may stop growing or even push the robot on, and a
//! simulation that gets there does not come back. Three limits prevent this:
//!
//! - the network is evaluated at velocities clamped to their training range;
//! - its force is clamped to the range of the training forces;
//! - a velocity beyond its range meets an additional drag along its axis,
//!
//! ```text
//! f = -F s |s|  for |s| <= 1,   f = -F sign(s) (2 |s| - 1)  beyond,   s = d / h
//! ```
//!
//! with d the distance of the velocity from its range, h half the width of the widest range of its kind (linear or
//! angular) and F the greatest training force along the axis. The drag begins with zero slope, as quadratic drag does, and
//! at d = h equals F, so it outweighs the network's force. Its slope is at most 2 F / h: held over a sample period T it is
//! stable on a mass m while F T / (h m) < 1 (the B1 robot: 0.1 along y). The velocity 0 always counts as in range. Within
//! the ranges nothing changes.

use serde::{Deserialize, Serialize};

use crate::{
    features::{Feature, FeatureLayout},
    outputs::Output,
};

/// Least and greatest values in a training split.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Envelope {
    /// Least value of each feature [n] (SI), in the layout's order.
    pub least: Vec<f64>,
    /// Greatest value of each [n].
    pub most: Vec<f64>,
    /// Least value of each force component [f] (N, N m), in the order of the outputs.
    pub least_force: Vec<f64>,
    /// Greatest value of each [f].
    pub most_force: Vec<f64>,
}

impl Envelope {
    /// Reason why these numbers do not serve `inputs` features and `outputs` force components, if there is one.
    pub fn fault(&self, inputs: usize, outputs: usize) -> Option<String> {
        let sides = [
            ("least", &self.least, "most", &self.most, inputs),
            (
                "least_force",
                &self.least_force,
                "most_force",
                &self.most_force,
                outputs,
            ),
        ];
        sides
            .into_iter()
            .find_map(|(low, least, high, most, expected)| {
                for (name, values) in [(low, least), (high, most)] {
                    if values.len() != expected {
                        let found = values.len();
                        return Some(format!(
                            "envelope.{name} has {found} numbers, not {expected}"
                        ));
                    }
                    if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                        return Some(format!("envelope.{name}[{index}] is {}", values[index]));
                    }
                }
                let index = least
                    .iter()
                    .zip(most)
                    .position(|(least, most)| least > most)?;
                Some(format!(
                    "envelope.{low}[{index}] is {}, above envelope.{high}[{index}], {}",
                    least[index], most[index]
                ))
            })
    }

    /// Every range `factor` times as wide about its centre; ranges of forces `factor^2` times, since forces grow with the
    /// square of a velocity.
    #[must_use]
    pub fn widened(mut self, factor: f64) -> Self {
        let widen = |least: &mut [f64], most: &mut [f64], factor: f64| {
            for (least, most) in least.iter_mut().zip(most) {
                let (centre, half) = (0.5 * (*least + *most), 0.5 * (*most - *least));
                (*least, *most) = (centre - factor * half, centre + factor * half);
            }
        };
        widen(&mut self.least, &mut self.most, factor);
        widen(&mut self.least_force, &mut self.most_force, factor * factor);
        self
    }
}

/// An envelope tied to the features and forces of a card. The default limits nothing.
#[derive(Clone, Debug, Default)]
pub struct Limits {
    envelope: Envelope,
    /// The velocities among the features, each with its index.
    velocities: Vec<(usize, Feature)>,
    /// For each output [f], the drag on an out-of-range velocity along it.
    drags: Vec<Option<Drag>>,
}

/// The velocity furthest out of its range, in half widths of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Excess {
    /// Its name.
    pub velocity: Feature,
    /// Its value [m/s, rad/s].
    pub found: f64,
    /// Least and greatest value that the network is given [m/s, rad/s].
    pub range: (f64, f64),
    /// Number of other velocities outside their ranges.
    pub others: usize,
}

/// Drag along an axis on a velocity outside its range.
#[derive(Clone, Copy, Debug)]
struct Drag {
    /// Index of the velocity among the features.
    at: usize,
    /// h [m/s, rad/s], positive.
    width: f64,
    /// F [N, N m].
    force: f64,
}

impl Limits {
    /// Ties `envelope`, whose ranges are in the order of `layout` and of `outputs`, to both.
    pub fn new(mut envelope: Envelope, layout: &FeatureLayout, outputs: &[String]) -> Self {
        let velocities = layout.features().iter().cloned().enumerate();
        let velocities: Vec<_> = velocities.filter(|(_, of)| is_velocity(of)).collect();
        // Data without rest would leave 0 outside the range, and the drag would push a robot at rest.
        for (at, _) in &velocities {
            envelope.least[*at] = envelope.least[*at].min(0.0);
            envelope.most[*at] = envelope.most[*at].max(0.0);
        }
        let half = |at: usize| 0.5 * (envelope.most[at] - envelope.least[at]);
        let drag = |(output, name): (usize, &String)| {
            let feature = velocity_along(name)?;
            let kind = layout.features().iter().enumerate();
            let widest = kind
                .filter(|(_, other)| {
                    std::mem::discriminant(*other) == std::mem::discriminant(&feature)
                })
                .map(|(at, _)| half(at))
                .fold(0.0, f64::max);
            let at = layout.index_of(&feature)?;
            let (least, most) = (envelope.least_force[output], envelope.most_force[output]);
            Some(Drag {
                at,
                width: widest,
                force: least.abs().max(most.abs()),
            })
            .filter(|drag| drag.width > 0.0)
        };
        Self {
            velocities,
            drags: outputs.iter().enumerate().map(drag).collect(),
            envelope,
        }
    }

    /// Drag [f] (N, N m) on the velocities of `x` [n] that are outside their ranges.
    pub fn drag(&self, x: &[f64], force: &mut [f64]) {
        force.fill(0.0);
        for (force, drag) in force.iter_mut().zip(&self.drags) {
            let Some(drag) = drag else {
                continue;
            };
            let share = (x[drag.at] - self.held(drag.at, x[drag.at])) / drag.width;
            let size = share.abs();
            let grown = if size < 1.0 {
                size * size
            } else {
                2.0 * size - 1.0
            };
            *force = -drag.force * grown * share.signum();
        }
    }

    /// Clamps the velocities of `x` [n] to their ranges.
    pub fn hold(&self, x: &mut [f64]) {
        for (at, _) in &self.velocities {
            x[*at] = self.held(*at, x[*at]);
        }
    }

    /// The velocity of `x` [n] that is furthest out of its range, if one is.
    pub fn excess(&self, x: &[f64]) -> Option<Excess> {
        let outside = || {
            let velocities = self.velocities.iter();
            velocities.filter(|(at, _)| self.held(*at, x[*at]) != x[*at])
        };
        let share = |at: usize| {
            let half = 0.5 * (self.envelope.most[at] - self.envelope.least[at]);
            (x[at] - self.held(at, x[at])).abs() / half.max(f64::MIN_POSITIVE)
        };
        let (at, velocity) = outside().reduce(|one, two| {
            if share(two.0) > share(one.0) {
                two
            } else {
                one
            }
        })?;
        Some(Excess {
            velocity: velocity.clone(),
            found: x[*at],
            range: (self.envelope.least[*at], self.envelope.most[*at]),
            others: outside().count() - 1,
        })
    }

    /// Clamps a force [f] to the range of the training forces.
    pub fn hold_force(&self, force: &mut [f64]) {
        let ranges = self
            .envelope
            .least_force
            .iter()
            .zip(&self.envelope.most_force);
        for (force, (least, most)) in force.iter_mut().zip(ranges) {
            *force = force.clamp(*least, *most);
        }
    }

    fn held(&self, at: usize, value: f64) -> f64 {
        value.clamp(self.envelope.least[at], self.envelope.most[at])
    }
}

fn is_velocity(feature: &Feature) -> bool {
    matches!(
        feature,
        Feature::JointVelocity(_) | Feature::AngularVelocity(_) | Feature::LinearVelocity(_)
    )
}

/// Velocity along an output: `force.x` to linear velocity x, `torque.x` to angular velocity x, the torque of a joint to the
/// joint's velocity.
fn velocity_along(output: &str) -> Option<Feature> {
    match output.parse().ok()? {
        Output::Component(axis @ 0..3) => Some(Feature::LinearVelocity(axis)),
        Output::Component(axis) => Some(Feature::AngularVelocity(axis - 3)),
        Output::Joint(name) => Some(Feature::JointVelocity(name)),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use proptest::prelude::*;

    use super::*;

    /// A floating base with one joint, faster forward than back, that was never moved sideways.
    fn envelope() -> (Envelope, FeatureLayout, Vec<String>) {
        let layout = FeatureLayout::floating_base(&["fin".to_owned()]).unwrap();
        let outputs = ["force.x", "force.y", "torque.z"].map(str::to_owned);
        let mut most = vec![1.0; layout.len()];
        let mut least = vec![-1.0; layout.len()];
        let at = |feature| layout.index_of(&feature).unwrap();
        most[at(Feature::LinearVelocity(0))] = 3.0;
        for side in [&mut least, &mut most] {
            side[at(Feature::LinearVelocity(1))] = 0.0;
        }
        let envelope = Envelope {
            least,
            most,
            least_force: vec![-40.0, -2.0, -5.0],
            most_force: vec![20.0, 2.0, 8.0],
        };
        (envelope, layout, outputs.to_vec())
    }

    fn limits() -> (Limits, FeatureLayout) {
        let (envelope, layout, outputs) = envelope();
        (Limits::new(envelope, &layout, &outputs), layout)
    }

    #[test]
    fn what_is_too_fast_is_held_and_braked_along_its_own_axis() {
        let (limits, layout) = limits();
        let mut x = vec![0.0; layout.len()];
        let at = |feature| layout.index_of(&feature).unwrap();
        let mut drag = [f64::NAN; 3];
        let mut of = |x: &[f64]| {
            limits.drag(x, &mut drag);
            drag
        };
        assert_eq!(of(&x), [0.0; 3]);
        // -1 to 3: half the width is 2.
        x[at(Feature::LinearVelocity(0))] = -2.0;
        assert_eq!(of(&x), [10.0, 0.0, 0.0], "40 / 2^2");
        x[at(Feature::LinearVelocity(0))] = 5.0;
        assert_eq!(of(&x), [-40.0, 0.0, 0.0]);
        x[at(Feature::LinearVelocity(0))] = 9.0;
        assert_eq!(of(&x), [-40.0 * 5.0, 0.0, 0.0], "linear from there on");
        // Never moved in training: as wide as the widest.
        x[at(Feature::LinearVelocity(1))] = 1.0;
        assert_eq!(of(&x)[1], -2.0 * 0.5f64.powi(2));
        x[at(Feature::AngularVelocity(2))] = -2.0;
        assert_eq!(of(&x)[2], 8.0);
        // What is no velocity is left alone.
        x[at(Feature::JointPosition("fin".into()))] = 7.0;
        x[at(Feature::JointVelocity("fin".into()))] = 7.0;
        x[at(Feature::Density)] = 1025.0;
        limits.hold(&mut x);
        let held = |feature| x[at(feature)];
        assert_eq!(held(Feature::LinearVelocity(0)), 3.0);
        assert_eq!(held(Feature::LinearVelocity(1)), 0.0);
        assert_eq!(held(Feature::AngularVelocity(2)), -1.0);
        assert_eq!(held(Feature::JointVelocity("fin".into())), 1.0);
        assert_eq!(held(Feature::JointPosition("fin".into())), 7.0);
        assert_eq!(held(Feature::Density), 1025.0);
        let mut force = [-100.0, 1.0, 100.0];
        limits.hold_force(&mut force);
        assert_eq!(force, [-40.0, 1.0, 8.0]);
    }

    #[test]
    fn the_worst_velocity_is_named_and_the_others_are_counted() {
        let (limits, layout) = limits();
        let mut x = vec![0.0; layout.len()];
        let at = |feature| layout.index_of(&feature).unwrap();
        assert_eq!(limits.excess(&x), None);
        x[at(Feature::JointVelocity("fin".into()))] = 1.5;
        x[at(Feature::LinearVelocity(0))] = 4.0;
        x[at(Feature::AngularVelocity(2))] = -3.0;
        let excess = limits.excess(&x).unwrap();
        assert_eq!(excess.velocity, Feature::AngularVelocity(2));
        assert_eq!((excess.found, excess.range), (-3.0, (-1.0, 1.0)));
        assert_eq!(excess.others, 2);
    }

    #[test]
    fn a_widened_range_has_the_same_centre_and_its_forces_grow_with_the_square() {
        let (envelope, layout, _) = envelope();
        let at = layout.index_of(&Feature::LinearVelocity(0)).unwrap();
        let wide = envelope.widened(2.0);
        assert_eq!((wide.least[at], wide.most[at]), (-3.0, 5.0));
        assert_eq!((wide.least_force[0], wide.most_force[0]), (-130.0, 110.0));
    }

    #[test]
    fn a_range_that_is_none_is_named() {
        let (good, layout, outputs) = envelope();
        let fault = |change: &dyn Fn(&mut Envelope)| {
            let mut envelope = good.clone();
            change(&mut envelope);
            envelope.fault(layout.len(), outputs.len())
        };
        assert_eq!(fault(&|_| ()), None);
        for (change, expected) in [
            (
                (&|e: &mut Envelope| e.most.truncate(2)) as &dyn Fn(&mut Envelope),
                "envelope.most has 2 numbers, not 13",
            ),
            (
                &|e| e.least_force[1] = f64::NAN,
                "envelope.least_force[1] is NaN",
            ),
            (
                &|e| e.most_force[2] = -6.0,
                "envelope.least_force[2] is -5, above envelope.most_force[2], -6",
            ),
        ] {
            assert_eq!(fault(change).as_deref(), Some(expected));
        }
    }

    /// A robot that the network drives with all that it has, and that is pushed by nothing else.
    #[test]
    fn a_force_of_the_network_is_balanced_within_half_a_width_more() {
        let (limits, layout) = limits();
        let at = layout.index_of(&Feature::LinearVelocity(0)).unwrap();
        // Forward the network has half of the greatest force, back all of it; half the width is 2 m/s.
        for (push, balanced) in [(1e6, 3.0 + 2.0 * 0.5f64.sqrt()), (-1e6, -1.0 - 2.0)] {
            let mut x = vec![0.0; layout.len()];
            for _ in 0..5000 {
                let mut drag = [0.0; 3];
                limits.drag(&x, &mut drag);
                let mut learned = [push, 0.0, 0.0];
                limits.hold_force(&mut learned);
                x[at] += 0.01 * (learned[0] + drag[0]) / 5.0;
            }
            assert!((x[at] - balanced).abs() < 1e-6, "{} m/s", x[at]);
        }
    }

    proptest! {
        #[test]
        fn the_drag_takes_energy_and_never_comes_in_a_jump(
            v in -50.0..50.0f64, least in -3.0..3.0f64, width in 0.5..4.0f64
        ) {
            let (mut envelope, layout, outputs) = envelope();
            let at = layout.index_of(&Feature::LinearVelocity(0)).unwrap();
            (envelope.least[at], envelope.most[at]) = (least, least + width);
            let limits = Limits::new(envelope, &layout, &outputs);
            let of = |v: f64| {
                let (mut x, mut drag) = (vec![0.0; layout.len()], [0.0; 3]);
                x[at] = v;
                limits.drag(&x, &mut drag);
                drag[0]
            };
            prop_assert!(of(v) * v <= 0.0);
            let slope = (of(v + 1e-6) - of(v)) / 1e-6;
            // The other linear velocities are 2 m/s wide.
            let steepest = 2.0 * 40.0 / 1.0;
            prop_assert!((-steepest - 1e-3..=1e-6).contains(&slope), "{}", slope);
        }
    }
}
