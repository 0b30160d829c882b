//! The quantities that an expression may name, by the target: names, units and bounds.
//!
//! A simulation's values are held within the bounds before an expression sees them, so that what was shown of an expression
//! holds while it runs.

use super::{
    check::{Facts, Range},
    units::Dimension,
};

/// Greatest speed [m/s] and rate [rad/s].
pub(crate) const FAST: f64 = 1e4;
/// Greatest distance, depth [m] and angle [rad].
const FAR: f64 = 1e5;
/// Greatest time [s].
const LATE: f64 = 1e9;
/// Greatest density [kg/m^3].
const DENSE: f64 = 1e5;
/// Greatest command.
const COMMAND: f64 = 1e6;

/// Kind of thing that an effect acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Body,
    Hinge,
    Slide,
}

impl Kind {
    pub(crate) const ALL: [(&'static str, Self); 3] = [
        ("body", Self::Body),
        ("hinge", Self::Hinge),
        ("slide", Self::Slide),
    ];
}

/// A quantity of the simulation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quantity {
    pub(crate) name: &'static str,
    pub(crate) dimension: Dimension,
    pub(crate) range: Range,
}

impl Quantity {
    pub(crate) fn facts(self) -> Facts {
        Facts {
            dimension: Some(self.dimension),
            range: self.range,
        }
    }
}

fn up_to(name: &'static str, dimension: Dimension, bound: f64) -> Quantity {
    Quantity {
        name,
        dimension,
        range: Range::new(-bound, bound),
    }
}

fn never_negative(name: &'static str, dimension: Dimension, bound: f64) -> Quantity {
    Quantity {
        name,
        dimension,
        range: Range::new(0.0, bound),
    }
}

/// Quantities of a body, in this order: velocity relative to the water (6), place (3), velocity relative to the water in the
/// world (3), upward direction in the body's frame (3), depth, time, density.
pub(crate) const BODY: usize = 18;
/// Quantities of a joint, in this order: position, velocity, time.
pub(crate) const JOINT: usize = 3;

/// The quantities of a target, in order.
pub(crate) fn quantities(kind: Kind) -> Vec<Quantity> {
    use Dimension as D;
    match kind {
        Kind::Body => vec![
            up_to("nu_surge", D::SPEED, FAST),
            up_to("nu_sway", D::SPEED, FAST),
            up_to("nu_heave", D::SPEED, FAST),
            up_to("nu_roll", D::RATE, FAST),
            up_to("nu_pitch", D::RATE, FAST),
            up_to("nu_yaw", D::RATE, FAST),
            up_to("x", D::METRE, FAR),
            up_to("y", D::METRE, FAR),
            up_to("z", D::METRE, FAR),
            up_to("v_x", D::SPEED, FAST),
            up_to("v_y", D::SPEED, FAST),
            up_to("v_z", D::SPEED, FAST),
            up_to("up_x", D::NUMBER, 1.0),
            up_to("up_y", D::NUMBER, 1.0),
            up_to("up_z", D::NUMBER, 1.0),
            up_to("depth", D::METRE, FAR),
            never_negative("t", D::SECOND, LATE),
            never_negative("rho", D::DENSITY, DENSE),
        ],
        Kind::Hinge | Kind::Slide => {
            let (position, velocity) = if kind == Kind::Hinge {
                (D::NUMBER, D::RATE)
            } else {
                (D::METRE, D::SPEED)
            };
            vec![
                up_to("q", position, FAR),
                up_to("qdot", velocity, FAST),
                never_negative("t", D::SECOND, LATE),
            ]
        }
    }
}

/// The command of an actuator, in its own unit.
pub(crate) fn command() -> Facts {
    Facts {
        dimension: Some(Dimension::NUMBER),
        range: Range::new(-COMMAND, COMMAND),
    }
}
