//! Work and power of the predicted drag beside the true one's.

use hydro_model::features::{Feature, FeatureLayout};
use serde::{Deserialize, Serialize};

use crate::dataset::Split;

/// Power and work of the wrench without its hydrostatic part on the base's motion: force times velocity and torque times
/// angular velocity, over the axes that both the outputs and the features hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Root mean square over trajectories of the error of the work, over that of the true work.
    pub work_error: f64,
    /// RMSE of the power over the standard deviation of the true power.
    pub power_error: f64,
    /// Share of samples at which the predicted drag part gives the base energy.
    pub gives: f64,
    /// The same of the truth: legs that push give energy through the water.
    pub gives_truth: f64,
}

/// Columns: of an output, of the velocity that it works on.
fn pairs(layout: &FeatureLayout, outputs: &[String]) -> Vec<(usize, usize)> {
    let axis = |name: &str| ["x", "y", "z"].iter().position(|known| *known == name);
    outputs
        .iter()
        .enumerate()
        .filter_map(|(at, name)| {
            let velocity = match name.split_once('.')? {
                ("force", name) => Feature::LinearVelocity(axis(name)?),
                ("torque", name) => Feature::AngularVelocity(axis(name)?),
                _ => return None,
            };
            Some((at, layout.index_of(&velocity)?))
        })
        .collect()
}

/// Work and power of predicted trajectories `[M][T * f]`; `None` if no output acts along a velocity among the features.
pub(super) fn energy(
    layout: &FeatureLayout,
    outputs: &[String],
    split: &Split,
    forces: &[Vec<f64>],
) -> Option<Energy> {
    let pairs = pairs(layout, outputs);
    if pairs.is_empty() || split.samples() < 2 {
        return None;
    }
    let (n, f) = (split.inputs(), split.outputs());
    let mut work = [0.0; 2];
    let (mut power_error, mut sum, mut square) = (0.0, 0.0, 0.0);
    let (mut gives, mut gives_truth, mut count) = (0.0, 0.0, 0.0);
    for (index, forces) in forces.iter().enumerate() {
        let (x, hydrostatic) = (split.x(index), split.hydrostatic(index));
        let clean = split.clean(index);
        let (mut done, mut true_work) = (0.0, 0.0);
        for k in 1..split.samples() {
            let period = f64::from(split.time()[k] - split.time()[k - 1]);
            let (mut power, mut truth) = (0.0, 0.0);
            for (axis, velocity) in &pairs {
                let velocity = f64::from(x[k * n + velocity]);
                let rest = f64::from(hydrostatic[k * f + axis]);
                power += (forces[k * f + axis] - rest) * velocity;
                truth += (f64::from(clean[k * f + axis]) - rest) * velocity;
            }
            done += power * period;
            true_work += truth * period;
            power_error += (power - truth).powi(2);
            sum += truth;
            square += truth * truth;
            gives += f64::from(u8::from(power > 0.0));
            gives_truth += f64::from(u8::from(truth > 0.0));
            count += 1.0;
        }
        work[0] += (done - true_work).powi(2);
        work[1] += true_work.powi(2);
    }
    let variance = square / count - (sum / count).powi(2);
    // Without work or power there is nothing to compare with.
    (work[1] > 0.0 && variance > 0.0).then(|| Energy {
        work_error: (work[0] / work[1]).sqrt(),
        power_error: (power_error / count / variance).sqrt(),
        gives: gives / count,
        gives_truth: gives_truth / count,
    })
}
