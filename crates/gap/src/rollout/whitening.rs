//! Whitening: output errors in standard deviations of their sensor's noise.

use crate::problem::channels::Channels;

/// Divides residuals by the noise of their channel [rows * channels]; a missing reading becomes zero.
pub(crate) fn whiten(channels: &Channels, residuals: &mut [f64]) {
    let width = channels.len();
    for (at, value) in residuals.iter_mut().enumerate() {
        *value = if value.is_finite() {
            *value / channels.list[at % width].noise
        } else {
            0.0
        };
    }
}
