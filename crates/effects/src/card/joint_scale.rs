//! Sizes of a joint, typical forces and speeds made from them for priors (never zero), and its units.

/// Speed where no trials are known [rad/s or m/s].
const SLOW: f64 = 0.1;

/// Excursion where no trials are known [rad or m].
const SMALL: f64 = 0.1;

/// Bounds, as multiples of a great force.
const GENEROUS: f64 = 100.0;

/// Deceleration of a sudden stop [rad/s^2 or m/s^2].
const SUDDEN: f64 = 100.0;

/// Sizes of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointScale {
    /// Inertia that the joint moves, its armature with it [kg m^2 or kg].
    pub inertia: f64,
    /// Rotor inertia that it has [kg m^2 or kg].
    pub armature: f64,
    /// Largest torque that gravity or the actuator puts on it [N m or N].
    pub torque: f64,
    /// Viscous damping that it has, its servo's with it [N m s/rad or N s/m].
    pub damping: f64,
    /// Typical speed in the trials [rad/s or m/s].
    pub speed: f64,
    /// Typical excursion in the trials [rad or m].
    pub travel: f64,
    /// Middle of its motion in the trials [rad or m].
    pub middle: f64,
    /// True for a slide.
    pub slides: bool,
    /// True where an actuator drives it.
    pub driven: bool,
}

impl JointScale {
    /// Typical speed [rad/s or m/s].
    pub(crate) fn typical_speed(&self) -> f64 {
        positive(self.speed, SLOW)
    }

    /// Inertia that the joint moves [kg m^2 or kg].
    pub(crate) fn typical_inertia(&self) -> f64 {
        positive(self.inertia, 1.0)
    }

    /// Typical excursion [rad or m].
    pub(crate) fn typical_travel(&self) -> f64 {
        positive(self.travel, SMALL)
    }

    /// Typical force [N m or N]: gravity's, the actuator's, the damping's, or the one that swings the inertia through its
    /// travel.
    pub(crate) fn typical_force(&self) -> f64 {
        let swing = self.inertia * self.typical_speed().powi(2) / self.typical_travel();
        let damped = self.damping * self.typical_speed();
        positive(self.torque.max(swing).max(damped), 1.0)
    }

    /// Upper bound of a force [N m or N]: a hundred times that of gravity or the actuator plus that of a sudden stop.
    pub(crate) fn greatest_force(&self) -> f64 {
        GENEROUS * positive(self.torque + self.inertia * SUDDEN, 1.0)
    }

    /// Unit of an inertia.
    pub(crate) fn inertia_unit(&self) -> &'static str {
        if self.slides { "kg" } else { "kg m^2" }
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
