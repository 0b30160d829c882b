//! Waves and currents against closed forms, differences, independent computations and odd files.

use proptest::prelude::*;

use super::{Wave, WaveField};

mod currents;
mod kinematics;
mod odd_files;
mod refusals;
mod spectra;
mod speed;

const GRAVITY: f64 = 9.81;

fn sea(waves: &[Wave], depth: Option<f64>) -> WaveField {
    let (sea, _) = WaveField::new(waves, depth, GRAVITY).expect("a sea");
    sea
}

fn read(text: &str) -> WaveField {
    let (sea, _) = WaveField::parse(text, GRAVITY).expect("a sea");
    sea
}

/// A gentle sea of one to twelve waves in water of any depth.
fn any_sea() -> impl Strategy<Value = WaveField> {
    let wave = (0.0..1.0, 1.5..12.0, -4.0..4.0, -4.0..4.0);
    let depth = prop::option::of(0.5..60.0);
    (prop::collection::vec(wave, 1..12), depth).prop_map(|(waves, depth)| {
        let waves: Vec<Wave> = waves
            .into_iter()
            .map(|(share, period, direction, phase)| Wave {
                amplitude: 0.01 * share * period,
                period,
                direction,
                phase,
            })
            .collect();
        sea(&waves, depth)
    })
}

/// A point below the still level, above the bed, and a time.
fn any_place() -> impl Strategy<Value = ([f64; 3], f64)> {
    ([-30.0..30.0, -30.0..30.0, -0.45..-0.05], 0.0..100.0)
}
