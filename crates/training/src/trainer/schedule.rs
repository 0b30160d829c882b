//! Learning rate by step: a linear rise, then a cosine down to a share of the maximum.

use super::config::TrainConfig;

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
#[path = "tests/schedule.rs"]
mod tests;
