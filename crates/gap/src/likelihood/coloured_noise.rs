//! Noise of a segment's readings: white, and for sensors that declare none also correlated along the rows.
//!
//! The correlated part is a Matern process of order 3/2 (C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine
//! Learning, MIT Press 2006, eq. 4.17) within a segment, independent from segment to segment.

use nalgebra::DMatrix;

use crate::problem::sensor_noise::Drifting;

/// Whitens the columns of readings, row by row and channel by channel [rows * channels, columns], that are whitened for the
/// white part already, and gives half the logarithm of the covariance's determinant beside it; infinite where there is none.
///
/// `sd`: standard deviation of the correlated part, as a part of [`Drifting::scale`]. `weights`: factor from a reading to its
/// whitened value; zero where there is none. `times`: of the rows [s]; `time`: the process's time constant [s].
pub(super) fn whiten(
    readings: &mut DMatrix<f64>,
    sd: f64,
    drifting: &[Drifting],
    channels: usize,
    weights: &[f64],
    (times, time): (&[f64], f64),
) -> f64 {
    let mut half_logs = 0.0;
    if sd == 0.0 {
        return half_logs;
    }
    for of in drifting {
        let rows: Vec<usize> = (0..times.len())
            .filter(|row| weights[row * channels + of.channel] > 0.0)
            .collect();
        let size = |row: usize| sd * of.scale * weights[row * channels + of.channel];
        let covariance = DMatrix::from_fn(rows.len(), rows.len(), |a, b| {
            let (a, b) = (rows[a], rows[b]);
            let apart = (times[a] - times[b]).abs() / time;
            let white = f64::from(u8::from(a == b));
            white + size(a) * size(b) * (1.0 + apart) * (-apart).exp()
        });
        // No smaller than unity, so that only what is not a number has no factor.
        let Some(factor) = covariance.cholesky() else {
            return f64::INFINITY;
        };
        half_logs += factor.l_dirty().diagonal().map(f64::ln).sum();
        let places: Vec<usize> = rows.iter().map(|row| row * channels + of.channel).collect();
        let mut own = readings.select_rows(&places);
        if factor.l_dirty().solve_lower_triangular_mut(&mut own) {
            for (place, row) in places.iter().zip(own.row_iter()) {
                readings.set_row(*place, &row);
            }
        }
    }
    half_logs
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// Squares of the whitened readings and the determinant are those of the covariance.
    #[test]
    fn it_is_the_density_of_the_covariance() {
        let times = [0.0, 0.02, 0.05, 0.06];
        // The second channel declares its noise; the first lacks a reading.
        let weights = [10.0, 4.0, 10.0, 4.0, 0.0, 4.0, 10.0, 4.0];
        let drifting = [Drifting {
            channel: 0,
            scale: 2.0,
        }];
        let values = DVector::from_vec(vec![0.3, 1.0, -0.2, 2.0, 0.0, 3.0, 0.5, 4.0]);
        let mut whitened = DMatrix::from_column_slice(8, 1, values.as_slice());
        let half = whiten(&mut whitened, 0.1, &drifting, 2, &weights, (&times, 0.04));
        let rows = [0, 1, 3];
        let covariance = DMatrix::from_fn(3, 3, |a, b| {
            let apart = (times[rows[a]] - times[rows[b]]).abs() / 0.04;
            f64::from(u8::from(a == b)) + 4.0 * (1.0 + apart) * (-apart).exp()
        });
        let own = DVector::from_vec(vec![0.3, -0.2, 0.5]);
        let expected = own.dot(&(covariance.clone().try_inverse().unwrap() * &own));
        let found: f64 = [0, 2, 6].iter().map(|row| whitened[*row].powi(2)).sum();
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        assert!((half - 0.5 * covariance.determinant().ln()).abs() < 1e-12);
        assert_eq!((whitened[1], whitened[3], whitened[4]), (1.0, 2.0, 0.0));
    }
}
