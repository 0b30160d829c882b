//! The water around an instance: its surface, its waves, and a current that changes with place, depth and time.

use std::sync::Arc;

use hydro_effects::sea::{CurrentField, WaveField};
use nalgebra::{Matrix3, Vector3};

/// Surface, waves and current of the attributes `waterline`, `waves` and `current`. In the world: z up, x y z [m].
#[derive(Clone, Debug, Default)]
pub struct Sea {
    /// Height of the still surface, world z [m]; `None`: far above, everything is submerged.
    pub waterline: Option<f64>,
    /// Waves about it.
    pub waves: Option<Arc<WaveField>>,
    /// A current that is more than three numbers.
    pub current: Option<Arc<CurrentField>>,
}

/// The plane that the surface is about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Unit normal towards the air, in the world.
    pub up: Vector3<f64>,
    /// A point of the plane, in the world [m].
    pub point: Vector3<f64>,
}

impl Surface {
    /// Normal and level of the plane in a frame of this attitude (columns: its axes in the world) and origin: `up . x <= level`
    /// is water.
    pub fn in_frame(&self, frame: &Matrix3<f64>, origin: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let level = self.up.dot(&(self.point - origin));
        (frame.tr_mul(&self.up), level)
    }
}

/// The water at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WaterMotion {
    /// Velocity in the world [m/s].
    pub velocity: Vector3<f64>,
    /// Acceleration in the world [m/s^2].
    pub acceleration: Vector3<f64>,
}

impl Sea {
    /// True where there is more than still water without a surface.
    pub fn is_something(&self) -> bool {
        self.waterline.is_some() || self.moves()
    }

    /// True where the water moves.
    pub fn moves(&self) -> bool {
        self.waves.is_some() || self.current.is_some()
    }

    /// Height of the surface above a point, world z [m].
    pub fn level(&self, x: f64, y: f64, time: f64) -> Option<f64> {
        let waves = self.waves.as_ref();
        let elevation = waves.map_or(0.0, |waves| waves.elevation(x, y, time));
        self.waterline.map(|still| still + elevation)
    }

    /// The surface above a point: a plane with the wave's height and slope there.
    pub fn surface(&self, at: Vector3<f64>, time: f64) -> Option<Surface> {
        let still = self.waterline?;
        let waves = self.waves.as_ref();
        let (elevation, slope) =
            waves.map_or((0.0, [0.0; 2]), |waves| waves.surface(at.x, at.y, time));
        Some(Surface {
            up: Vector3::new(-slope[0], -slope[1], 1.0).normalize(),
            point: Vector3::new(at.x, at.y, still + elevation),
        })
    }

    /// Velocity and acceleration of the water at a point; `memory` is that of the current.
    pub fn motion(&self, at: Vector3<f64>, time: f64, memory: &[f64]) -> WaterMotion {
        let still = self.waterline.unwrap_or(0.0);
        let mut motion = WaterMotion::default();
        if let Some(waves) = &self.waves {
            let point = [at.x, at.y, at.z - still];
            let water = waves.kinematics(point, time);
            motion.velocity += Vector3::from(water.velocity);
            motion.acceleration += Vector3::from(water.acceleration);
        }
        motion.velocity += self.current(at, time, memory);
        motion
    }

    /// Velocity of a current that is more than three numbers, at a point [m/s]; `memory` is that of its random part and of what a program sets.
    pub fn current(&self, at: Vector3<f64>, time: f64, memory: &[f64]) -> Vector3<f64> {
        let still = self.waterline.unwrap_or(0.0);
        let current = self.current.as_ref();
        current.map_or_else(Vector3::zeros, |current| {
            Vector3::from(current.velocity([at.x, at.y], still - at.z, time, memory))
        })
    }

    /// The same sea without its waves.
    pub fn calm(&self) -> Self {
        Self {
            waves: None,
            ..self.clone()
        }
    }

    /// Dynamic pressure of the waves over density at a point [m^2/s^2].
    pub fn wave_pressure(&self, at: Vector3<f64>, time: f64) -> f64 {
        let point = [at.x, at.y, at.z - self.waterline.unwrap_or(0.0)];
        self.waves
            .as_ref()
            .map_or(0.0, |waves| waves.pressure(point, time))
    }

    /// Numbers of memory of the current: of its random part, and what a program sets.
    pub fn memory_len(&self) -> usize {
        self.current
            .as_ref()
            .map_or(0, |current| current.state_len())
    }

    /// Advances that memory over a step [s].
    pub fn advance(&self, memory: &mut [f64], step: f64) {
        if let Some(current) = &self.current {
            current.advance(memory, step);
        }
    }
}
