//! A run of ten minutes: peaks of the closed loop over the truth's.
//!
//! A force model that is right on recorded inputs can still be unstable once its force changes the
//! motion it sees. Position is exempt: a robot that is not neutral sinks for ever.

use hydro_frames::Wrench;
use serde::{Deserialize, Serialize};

use super::{drive::drive, method::Water};
use crate::{rollouts::Rollout, simulator::Simulator};

/// Largest allowed ratio of a long run's peaks to the truth's.
pub const BOUND: f64 = 1.5;

/// A greatest value beside the truth's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Greatest value in the method's run.
    pub reached: f64,
    /// Greatest value in the true run.
    pub truth: f64,
}

impl Peak {
    /// Ratio to the truth; infinite if the run diverged.
    pub fn ratio(&self) -> f64 {
        if self.reached.is_finite() {
            self.reached / self.truth
        } else {
            f64::INFINITY
        }
    }
}

/// Peaks of a long run beside those of the truth under the same controls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LongRunPeaks {
    /// Length of the run [s].
    pub duration: f64,
    /// Speed of the base [m/s].
    pub speed: Peak,
    /// Rate of turn of the base [rad/s].
    pub rate: Peak,
    /// Fluid force on the base [N].
    pub force: Peak,
    /// Fluid torque on the base [N m].
    pub torque: Peak,
}

/// Peaks over the truth's: speed, rate, force, torque; None of a run that diverged.
pub type Ratios = [Option<f64>; 4];

impl LongRunPeaks {
    /// Ratios of the peaks to the truth's.
    pub fn ratios(&self) -> Ratios {
        let finite = |peak: Peak| Some(peak.ratio()).filter(|ratio| ratio.is_finite());
        self.peaks().map(finite)
    }

    /// Speed, rate, force and torque, as in [`Ratios`].
    pub fn peaks(&self) -> [Peak; 4] {
        [self.speed, self.rate, self.force, self.torque]
    }

    /// True where no peak is more than `factor` times the truth's.
    pub fn within(&self, factor: f64) -> bool {
        within(&self.ratios(), &[Some(1.0); 4], factor)
    }
}

/// True where every ratio is at most `factor` times the larger of 1 (the truth's) and the other's. The other is usually the
/// oracle's: without water on the legs they move faster than in the truth, even under the true base wrench.
pub fn within(ratios: &Ratios, others: &Ratios, factor: f64) -> bool {
    ratios.iter().zip(others).all(|(ratio, other)| {
        let allowed = factor * other.map_or(1.0, |other| other.max(1.0));
        ratio.is_some_and(|ratio| ratio <= allowed)
    })
}

/// Peaks of a long run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LongRun {
    /// Under the subject.
    pub subject: LongRunPeaks,
    /// Under the true wrench at the robot's own state, where it can be told there.
    pub oracle: Option<LongRunPeaks>,
}

impl LongRun {
    /// True where the subject stays within `factor` times the oracle's peaks, or the truth's where those are greater.
    pub fn within(&self, factor: f64) -> bool {
        let oracle = self.oracle.as_ref().map(LongRunPeaks::ratios);
        within(&self.subject.ratios(), &oracle.unwrap_or_default(), factor)
    }
}

/// Runs a simulator through a long run.
pub fn long_run_peaks(
    simulator: &mut dyn Simulator,
    water: &Water<'_>,
    run: &Rollout,
) -> LongRunPeaks {
    let mut reached = [0.0f64; 4];
    let mut diverged = false;
    drive(simulator, run, water, &mut |simulator, wrench| {
        // After a blow-up MuJoCo resets itself, and the state looks calm again.
        diverged |= simulator.diverged();
        keep_peaks(&mut reached, simulator.qvel(), wrench);
    });
    if diverged {
        reached = [f64::INFINITY; 4];
    }
    let mut truth = [0.0f64; 4];
    for (velocity, wrench) in run.qvel.rows().zip(run.wrench.rows()).skip(1) {
        let mut values = [0.0; 6];
        values.copy_from_slice(wrench);
        keep_peaks(&mut truth, velocity, Wrench::from_array(values));
    }
    let peak = |i: usize| Peak {
        reached: reached[i],
        truth: truth[i],
    };
    LongRunPeaks {
        duration: run.time.last().copied().unwrap_or_default() - run.time[0],
        speed: peak(0),
        rate: peak(1),
        force: peak(2),
        torque: peak(3),
    }
}

/// Raises the peaks of speed, rate, force and torque; a value that is not finite is an infinite peak.
fn keep_peaks(peaks: &mut [f64; 4], velocity: &[f64], wrench: Wrench) {
    let norm = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let values = [
        norm(&velocity[..3]),
        norm(&velocity[3..6]),
        norm(&wrench.force),
        norm(&wrench.torque),
    ];
    for (peak, value) in peaks.iter_mut().zip(values) {
        *peak = if value.is_finite() {
            peak.max(value)
        } else {
            f64::INFINITY
        };
    }
}

#[cfg(test)]
#[path = "tests/long_run.rs"]
mod tests;
