//! Values of the schedule.

use super::*;

#[test]
fn the_rate_rises_to_the_top_and_falls_to_its_share() {
    let config = TrainConfig {
        learning_rate: 1.0,
        warm_up: 0.1,
        final_share: 0.01,
        ..TrainConfig::default()
    };
    let rate = |step| learning_rate(&config, step, 1000);
    assert!((rate(0) - 0.01).abs() < 1e-12);
    assert!((rate(99) - 1.0).abs() < 1e-12 && (rate(100) - 1.0).abs() < 1e-12);
    assert!((rate(550) - 0.505).abs() < 1e-12);
    assert!((rate(1000) - 0.01).abs() < 1e-12);
}
