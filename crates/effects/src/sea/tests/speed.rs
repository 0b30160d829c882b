//! Time of a sea at a point.

use std::{hint::black_box, time::Instant};

use crate::sea::WaveField;

/// Nanoseconds of a call, the least of many groups.
fn nanoseconds(mut call: impl FnMut(f64)) -> f64 {
    const CALLS: u32 = 500;
    (0..400)
        .map(|group| {
            let start = Instant::now();
            for index in 0..CALLS {
                call(f64::from(group) + 0.002 * f64::from(index));
            }
            start.elapsed().as_secs_f64() * 1e9 / f64::from(CALLS)
        })
        .fold(f64::INFINITY, f64::min)
}

/// `cargo test --release -p hydro-effects sea_speed -- --ignored --nocapture`
#[test]
#[ignore = "measures time"]
#[allow(clippy::print_stderr)]
fn sea_speed() {
    for (count, depth) in [(60, ""), (60, r#""depth": 20, "#), (1000, "")] {
        let text = format!(
            r#"{{"schema": "hydro-waves/1", {depth}"spectrum": "jonswap", "significant_height": 0.5, "peak_period": 5,
                 "spreading": 10, "components": {count}}}"#
        );
        let (sea, _) = WaveField::parse(&text, 9.81).expect("a sea");
        let whole = nanoseconds(|time| {
            black_box(sea.kinematics(black_box([1.0, 2.0, -0.7]), time));
        });
        let surface = nanoseconds(|time| {
            black_box(sea.surface(black_box(1.0), black_box(2.0), time));
        });
        let each = f64::from(count);
        eprintln!(
            "{count} components {depth}: all {whole:.0} ns, {:.1} a component; surface {surface:.0} ns, {:.1} a component",
            whole / each,
            surface / each
        );
    }
}
