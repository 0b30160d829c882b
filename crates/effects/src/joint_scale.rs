//! Typical forces and speeds of a joint, never zero, for priors; and its units.

use super::card::JointScale;

/// Speed of a joint that the trials say nothing of [rad/s or m/s].
const SLOW: f64 = 0.1;

/// Excursion of a joint that the trials say nothing of [rad or m].
const SMALL: f64 = 0.1;

/// Bounds are no expectations: so many times what is great.
const GENEROUS: f64 = 100.0;

/// Deceleration of a sudden stop [rad/s^2 or m/s^2].
const SUDDEN: f64 = 100.0;

impl JointScale {
    /// Typical speed [rad/s or m/s].
    pub(crate) fn typical_speed(&self) -> f64 {
        positive(self.speed, SLOW)
    }

    /// Typical excursion [rad or m].
    pub(crate) fn typical_travel(&self) -> f64 {
        positive(self.travel, SMALL)
    }

    /// Typical force: gravity's or the actuator's, or what swings the inertia through its travel
    /// [N m or N].
    pub(crate) fn typical_force(&self) -> f64 {
        let swing = self.inertia * self.typical_speed().powi(2) / self.typical_travel();
        positive(self.torque.max(swing), 1.0)
    }

    /// Greatest force with a meaning, whatever the trials do: of gravity or the actuator and of a sudden stop, many
    /// times [N m or N].
    pub(crate) fn greatest_force(&self) -> f64 {
        GENEROUS * positive(self.torque + self.inertia * SUDDEN, 1.0)
    }

    /// Unit of a force on the joint.
    pub(crate) fn force_unit(&self) -> &'static str {
        if self.slides { "N" } else { "N m" }
    }

    /// Unit of its speed.
    pub(crate) fn speed_unit(&self) -> &'static str {
        if self.slides { "m/s" } else { "rad/s" }
    }

    /// Unit of its position.
    pub(crate) fn position_unit(&self) -> &'static str {
        if self.slides { "m" } else { "rad" }
    }

    /// Unit of viscous damping.
    pub(crate) fn damping_unit(&self) -> &'static str {
        if self.slides { "N s/m" } else { "N m s/rad" }
    }

    /// Unit of stiffness.
    pub(crate) fn stiffness_unit(&self) -> &'static str {
        if self.slides { "N/m" } else { "N m/rad" }
    }
}

fn positive(found: f64, otherwise: f64) -> f64 {
    if found.is_finite() && found > 0.0 {
        found
    } else {
        otherwise
    }
}
