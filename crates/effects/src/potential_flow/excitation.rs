//! Force of waves on a body that scatters them.

use std::f64::consts::TAU;

use nalgebra::{Complex, Vector6};

use crate::sea::Component;

/// Complex forces of waves of 1 m amplitude.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Excitation {
    /// Angular frequencies [rad/s], ascending.
    pub(super) frequencies: Vec<f64>,
    /// Directions of travel [rad], ascending, within one turn.
    pub(super) directions: Vec<f64>,
    /// A row a frequency and direction, directions fastest.
    pub(super) forces: Vec<Vector6<Complex<f64>>>,
}

impl Excitation {
    /// Force [N, N m] of one wave, in axes of the body's heading [rad].
    pub(super) fn force(
        &self,
        wave: &Component,
        [x, y]: [f64; 2],
        heading: f64,
        time: f64,
    ) -> Vector6<f64> {
        let [along_x, along_y] = wave.wavenumber;
        let direction = libm::atan2(along_y, along_x) - heading;
        let unit = self.of_unit_wave(wave.frequency, direction);
        let phase = along_x * x + along_y * y - wave.frequency * time + wave.phase;
        let turn = Complex::new(libm::cos(phase), libm::sin(phase)) * wave.amplitude;
        unit.map(|force| (force * turn).re)
    }

    fn of_unit_wave(&self, frequency: f64, direction: f64) -> Vector6<Complex<f64>> {
        let (low, share) = bracket(&self.frequencies, frequency);
        let row = |at: usize| self.towards(at, direction);
        if share == 0.0 {
            return row(low);
        }
        mix(&row(low), &row(low + 1), share)
    }

    /// Linear in direction, all the way round where the list goes round.
    fn towards(&self, frequency: usize, direction: f64) -> Vector6<Complex<f64>> {
        let count = self.directions.len();
        let row = &self.forces[frequency * count..][..count];
        let (first, last) = (self.directions[0], self.directions[count - 1]);
        let direction = first + (direction - first).rem_euclid(TAU);
        if direction <= last {
            let (low, share) = bracket(&self.directions, direction);
            return match share == 0.0 {
                true => row[low],
                false => mix(&row[low], &row[low + 1], share),
            };
        }
        // Between the last direction and the first of the next turn.
        mix(
            &row[count - 1],
            &row[0],
            (direction - last) / (first + TAU - last),
        )
    }
}

fn mix(
    one: &Vector6<Complex<f64>>,
    other: &Vector6<Complex<f64>>,
    share: f64,
) -> Vector6<Complex<f64>> {
    one.zip_map(other, |one, other| one * (1.0 - share) + other * share)
}

/// Index of the value before, and the share of the next: none outside.
fn bracket(values: &[f64], value: f64) -> (usize, f64) {
    let after = values.partition_point(|of| *of <= value);
    if after == 0 || after == values.len() {
        return (after.saturating_sub(1), 0.0);
    }
    let (low, high) = (values[after - 1], values[after]);
    (after - 1, (value - low) / (high - low))
}
