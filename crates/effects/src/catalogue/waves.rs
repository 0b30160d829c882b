//! Regular wave: water that oscillates, by its velocity and its pressure.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::axes;
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target, TargetKind, WaterPart,
    flow::SPEEDS,
};

/// Greatest orbital velocity [m/s].
const FASTEST: f64 = 5.0;
/// A tank's or a short sea's wave, of about three seconds [rad/s].
const FREQUENCY: f64 = 2.0;
/// Slowest and fastest waves [rad/s]: a long swell of 21 s, a ripple. A slower wave is a current in most trials.
const FREQUENCIES: [f64; 2] = [0.3, 30.0];

/// Parameters `x`, `y`, `z`: amplitude of the water's velocity in the world [m/s]; `frequency`
/// [rad/s]; `phase` [rad]; `vertical_lag` [rad], a quarter of a turn in a progressive wave.
///
/// The velocity is uniform, for trials that stay within a small part of a wavelength and of the wave's depth. It acts
/// through the relative velocity of every drag and of the nominal model's fluid, through the pressure that accelerates
/// the water ([`crate::Motion::froude_krylov`]), and through an added mass, if there is one.
#[derive(Debug)]
pub struct Waves;

static CARD: Card = Card {
    id: Id::Waves,
    phrase: "waves",
    target: TargetKind::Body,
    summary: "oscillating water: velocity and pressure of a regular wave",
    equation: "v_w = (x cos(frequency t + phase), y cos(frequency t + phase), z cos(frequency t + phase - \
               vertical_lag)) in the world; F = rho V a_w, and nu_r = nu - (R^T v_w, 0)",
    source: "G. B. Airy, Tides and Waves, Encyclopaedia Metropolitana 1841; J. R. Morison et al., Petroleum \
             Transactions AIME 189, 1950; J. N. Newman, Marine Hydrodynamics, MIT Press 1977, section 6.21",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for Waves {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            let speed = scale.typical_speed();
            let [slowest, fastest] = FREQUENCIES;
            let mut parameters: Vec<_> = axes::vector("m/s", [0.5 * speed; 3], [FASTEST; 3])
                .map(|component| component.physically(SPEEDS))
                .collect();
            parameters.extend([
                Parameter::about("frequency", "rad/s", FREQUENCY, FREQUENCY)
                    .within(slowest, fastest)
                    .physically(Physical::Positive)
                    .shaping(),
                // Wider than a turn, so that no fit gets stuck at a seam.
                Parameter::about("phase", "rad", 0.0, 0.5 * PI)
                    .within(-TAU, TAU)
                    .shaping(),
                Parameter::about("vertical_lag", "rad", FRAC_PI_2, 0.5)
                    .within(-TAU, TAU)
                    .shaping(),
            ]);
            parameters
        })
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Water(self)
    }
}

/// Amplitudes, frequency and the phase of each component now.
fn phases(p: &[f64], time: f64) -> ([f64; 3], f64, [f64; 3]) {
    let at = |index: usize| p.get(index).copied().unwrap_or(0.0);
    let frequency = at(3);
    let phase = frequency * time + at(4);
    (
        [at(0), at(1), at(2)],
        frequency,
        [phase, phase, phase - at(5)],
    )
}

impl WaterPart for Waves {
    fn velocity(&self, p: &[f64], _position: [f64; 3], time: f64) -> [f64; 3] {
        let (amplitude, _, phase) = phases(p, time);
        [0, 1, 2].map(|axis| amplitude[axis] * phase[axis].cos())
    }

    fn acceleration(&self, p: &[f64], _position: [f64; 3], time: f64) -> [f64; 3] {
        let (amplitude, frequency, phase) = phases(p, time);
        [0, 1, 2].map(|axis| -frequency * amplitude[axis] * phase[axis].sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    const P: [f64; 6] = [0.3, -0.1, 0.2, 2.5, 0.4, FRAC_PI_2];

    #[test]
    fn the_acceleration_is_the_velocitys_rate() {
        for time in [0.0, 0.7, 12.3] {
            let step = 1e-6;
            let (before, after) = (
                Waves.velocity(&P, [0.0; 3], time - step),
                Waves.velocity(&P, [0.0; 3], time + step),
            );
            let acceleration = Waves.acceleration(&P, [0.0; 3], time);
            for axis in 0..3 {
                let slope = (after[axis] - before[axis]) / (2.0 * step);
                assert!((acceleration[axis] - slope).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn a_progressive_wave_moves_water_in_ellipses() {
        for time in [0.1, 1.9, 30.0] {
            let [x, _, z] = Waves.velocity(&P, [0.0; 3], time);
            assert!(((x / 0.3).powi(2) + (z / 0.2).powi(2) - 1.0).abs() < 1e-9);
        }
    }

    /// A body of the water's density, free to move, is carried with the water: rho V a_w / (rho V).
    #[test]
    fn the_pressure_accelerates_displaced_water() {
        let mut motion = fixture::still();
        motion.water_acceleration = Waves.acceleration(&P, [0.0; 3], 0.6);
        motion.middle = [0.0, 0.0, 0.1];
        let wrench = motion.froude_krylov();
        let displaced = motion.density * motion.volume;
        for (force, acceleration) in wrench.iter().zip(motion.water_acceleration) {
            assert!((force / displaced - acceleration).abs() < 1e-12);
        }
        assert!((wrench[4] - 0.1 * wrench[0]).abs() < 1e-12);
    }
}
