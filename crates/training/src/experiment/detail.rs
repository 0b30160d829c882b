//! Errors by trajectory and by time within a trajectory.

use hydro_model::normaliser::Moments;
use serde::{Deserialize, Serialize};

use crate::dataset::Split;

/// Points of the curve of error against time.
const POINTS: usize = 50;

/// Errors against the clean wrench, in standard deviations of each axis over the split.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detail {
    /// Mean square over axes and samples, one entry a trajectory.
    pub by_trajectory: Vec<f64>,
    /// Time since the start [s] and nRMSE there over trajectories and axes.
    pub by_horizon: Vec<(f64, f64)>,
    /// Mean absolute and root mean square error over all axes and samples [N and N m together].
    pub pooled_si: (f64, f64),
}

/// Standard deviation of each of `width` columns over all rows of all trajectories.
pub(super) fn deviations<'a>(
    width: usize,
    trajectories: impl Iterator<Item = &'a [f32]>,
) -> Vec<f64> {
    let mut moments = Moments::new(width);
    for row in trajectories.flat_map(|rows| rows.chunks_exact(width)) {
        let row: Vec<f64> = row.iter().map(|value| f64::from(*value)).collect();
        moments.add(&row);
    }
    moments.std()
}

/// Errors of predicted trajectories `[M][T * f]`; the first sample is given and does not count.
pub(super) fn detail(split: &Split, forces: &[Vec<f64>]) -> Detail {
    let (f, samples) = (split.outputs(), split.samples());
    let std = deviations(f, (0..split.len()).map(|index| split.clean(index)));
    let mut by_trajectory = Vec::with_capacity(forces.len());
    let mut by_sample = vec![0.0; samples];
    let (mut absolute, mut square, mut count) = (0.0, 0.0, 0.0);
    for (index, forces) in forces.iter().enumerate() {
        let mut whole = 0.0;
        let rows = forces
            .chunks_exact(f)
            .zip(split.clean(index).chunks_exact(f));
        for (k, (force, clean)) in rows.enumerate().skip(1) {
            for ((force, clean), std) in force.iter().zip(clean).zip(&std) {
                let error = force - f64::from(*clean);
                absolute += error.abs();
                square += error * error;
                count += 1.0;
                let share = (error / std).powi(2) / f as f64;
                whole += share;
                by_sample[k] += share / split.len() as f64;
            }
        }
        by_trajectory.push(whole / (samples - 1) as f64);
    }
    // Neighbours are pooled: a point stands for the samples since the one before it.
    let each = (samples - 1).div_ceil(POINTS);
    let by_horizon = (1..samples)
        .step_by(each)
        .map(|first| {
            let end = (first + each).min(samples);
            let mean = by_sample[first..end].iter().sum::<f64>() / (end - first) as f64;
            let at = split.time()[end - 1] - split.time()[0];
            (f64::from(at), mean.sqrt())
        })
        .collect();
    Detail {
        by_trajectory,
        by_horizon,
        pooled_si: (absolute / count, f64::sqrt(square / count)),
    }
}
