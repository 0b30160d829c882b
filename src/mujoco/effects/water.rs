//! Velocity and acceleration of the water at a point: wind of MuJoCo's own fluid, current, and effects.

use nalgebra::Vector3;

use super::source::Source;
use crate::{mujoco::ffi::DataView, plugin::sea::WaterMotion};

/// Velocity of the water.
#[derive(Clone, Copy)]
pub(crate) struct Water<'a> {
    pub(crate) sources: &'a [Source<'a>],
    /// Wind [m/s]; zero unless MuJoCo's own fluid acts.
    pub(crate) wind: Vector3<f64>,
    pub(crate) time: f64,
}

impl<'a> Water<'a> {
    /// At the time of `data`.
    pub(crate) fn new(data: &DataView<'_>, sources: &'a [Source<'a>]) -> Self {
        let model = data.model();
        Self {
            sources,
            wind: if model.has_fluid() {
                Vector3::from(model.raw().opt.wind)
            } else {
                Vector3::zeros()
            },
            time: data.time(),
        }
    }

    pub(crate) fn at_time(self, time: f64) -> Self {
        Self { time, ..self }
    }

    /// True where an effect moves the water, or the waves of an instance.
    pub(crate) fn moves(&self) -> bool {
        self.sources
            .iter()
            .any(|source| !source.bound.water.is_empty() || !source.bound.in_waves.is_empty())
    }

    /// Velocity that effects add at a point [m/s].
    pub(crate) fn added(&self, at: Vector3<f64>) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for source in self.sources {
            for acting in &source.bound.water {
                if let Some(water) = acting.water() {
                    let velocity = water.velocity(&acting.parameters, at.into(), self.time);
                    sum += Vector3::from(velocity);
                }
            }
        }
        sum
    }

    /// Acceleration by effects at a point [m/s^2].
    pub(crate) fn acceleration(&self, at: Vector3<f64>) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for source in self.sources {
            for acting in &source.bound.water {
                if let Some(water) = acting.water() {
                    let rate = water.acceleration(&acting.parameters, at.into(), self.time);
                    sum += Vector3::from(rate);
                }
            }
        }
        sum
    }

    /// Velocity at a point, as the effects of a source see it [m/s].
    pub(crate) fn velocity(&self, source: &Source<'_>, at: Vector3<f64>) -> Vector3<f64> {
        self.wind
            + Vector3::from(source.bound.current)
            + self.added(at)
            + self.own(source, at).velocity
    }

    /// Velocity at a point without the waves of a source's own attributes [m/s].
    pub(crate) fn without_waves(&self, source: &Source<'_>, at: Vector3<f64>) -> Vector3<f64> {
        self.wind
            + Vector3::from(source.bound.current)
            + self.added(at)
            + source.bound.sea.current(at, self.time, source.sea_memory())
    }

    /// Motion of the sea of a source's own attributes at a point.
    pub(crate) fn own(&self, source: &Source<'_>, at: Vector3<f64>) -> WaterMotion {
        let sea = &source.bound.sea;
        if !sea.moves() {
            return WaterMotion::default();
        }
        sea.motion(at, self.time, source.sea_memory())
    }
}
