//! Learning rate by step: a linear rise, then a cosine down to a share of the top.

use super::TrainConfig;

/// Learning rate of step `step` of `steps`.
pub(super) fn learning_rate(config: &TrainConfig, step: usize, steps: usize) -> f64 {
    let rise = (config.warm_up * steps as f64).floor();
    let step = step as f64;
    if step < rise {
        return config.learning_rate * (step + 1.0) / rise;
    }
    let done = (step - rise) / (steps as f64 - rise).max(1.0);
    let cosine = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
    config.learning_rate * (config.final_share + (1.0 - config.final_share) * cosine)
}

#[cfg(test)]
mod tests {
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
}
