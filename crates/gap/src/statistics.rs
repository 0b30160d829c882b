//! Draws and order statistics that several stages need.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A draw from the standard normal distribution (Box and Muller).
pub(crate) fn standard_normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
    let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    (-2.0 * radius.ln()).sqrt() * angle.cos()
}

/// Interval that holds 95 % of values, from quantile to quantile; sorts them. `None` where there are none.
pub(crate) fn interval95(values: &mut [f64]) -> Option<[f64; 2]> {
    values.sort_by(f64::total_cmp);
    Some([quantile(values, 0.025)?, quantile(values, 0.975)?])
}

/// A quantile of ascending values, linear between neighbours; `None` where there are none.
pub(crate) fn quantile(ascending: &[f64], part: f64) -> Option<f64> {
    let last = ascending.len().checked_sub(1)?;
    let place = part * last as f64;
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    let weight = place - low as f64;
    Some(ascending[low] * (1.0 - weight) + ascending[high] * weight)
}
