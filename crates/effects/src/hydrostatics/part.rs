//! Volume and first moment of a part of space.

use std::{
    iter::Sum,
    ops::{Add, AddAssign, Sub},
};

use nalgebra::{Isometry3, Vector3};

/// Volume and first moment of volume of a part of a shape or hull, in the frame that the moment stands in.
///
/// Forces need the moment alone: the torque of buoyancy about the frame's origin is `density * gravity * moment x up`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Part {
    /// Volume [m^3].
    pub volume: f64,
    /// Integral of the position over the volume [m^4].
    pub moment: Vector3<f64>,
}

impl Part {
    /// Nothing.
    pub const NONE: Self = Self {
        volume: 0.0,
        moment: Vector3::new(0.0, 0.0, 0.0),
    };

    pub(super) const NAN: Self = Self {
        volume: f64::NAN,
        moment: Vector3::new(f64::NAN, f64::NAN, f64::NAN),
    };

    /// Centre of volume [m]; none without volume. The centre of a part of less than about 1e-12 of its shape is rounding.
    pub fn centre(&self) -> Option<Vector3<f64>> {
        (self.volume > 0.0).then(|| self.moment / self.volume)
    }

    /// The same part in the frame that `place` takes this one's points to.
    pub fn placed(&self, place: &Isometry3<f64>) -> Self {
        Self {
            volume: self.volume,
            moment: place.rotation * self.moment + self.volume * place.translation.vector,
        }
    }

    /// Moved by `offset` [m].
    pub(super) fn shifted(&self, offset: &Vector3<f64>) -> Self {
        Self {
            volume: self.volume,
            moment: self.moment + self.volume * offset,
        }
    }
}

impl Add for Part {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            volume: self.volume + other.volume,
            moment: self.moment + other.moment,
        }
    }
}

impl AddAssign for Part {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Part {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            volume: self.volume - other.volume,
            moment: self.moment - other.moment,
        }
    }
}

impl Sum for Part {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::NONE, Add::add)
    }
}
