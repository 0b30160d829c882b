//! Ten minutes in the water: does the closed loop stay within the truth's bounds?
//!
//! A force model that is right on recorded inputs can still be unstable once its force changes the
//! motion it sees. Position is exempt: a robot that is not neutral sinks for ever.

use hydro_frames::Wrench;
use serde::{Deserialize, Serialize};

use super::closed_loop::{Water, drive};
use crate::{rollouts::Rollout, simulator::Simulator};

/// How far beyond the truth's peaks a long run may go.
pub const BOUND: f64 = 1.5;

/// A greatest value beside the truth's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Greatest value in the contender's run.
    pub reached: f64,
    /// Greatest value in the true run.
    pub truth: f64,
}

impl Peak {
    /// How far beyond the truth; infinite where the run diverged.
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
pub struct Bounds {
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

impl Bounds {
    /// How far beyond the truth.
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

/// True where no ratio is more than `factor` times another's, or the truth's where that is greater. The oracle is one to be
/// measured by: legs that the water does not brake move faster than the truth's, whoever gives the base its wrench.
pub fn within(ratios: &Ratios, others: &Ratios, factor: f64) -> bool {
    ratios.iter().zip(others).all(|(ratio, other)| {
        let allowed = factor * other.map_or(1.0, |other| other.max(1.0));
        ratio.is_some_and(|ratio| ratio <= allowed)
    })
}

/// Runs a simulator through a long run.
pub fn bounds(simulator: &mut dyn Simulator, water: &Water<'_>, run: &Rollout) -> Bounds {
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
    Bounds {
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
mod tests {
    use super::*;
    use crate::rollouts::Table;
    use crate::simulator::PointMass;

    #[test]
    fn a_simulator_that_blew_up_and_calmed_down_is_out_of_bounds() {
        let still = |samples: usize, columns| Table::new(vec![0.0; samples * columns], columns);
        let pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        let run = Rollout {
            name: "still".into(),
            density: 1000.0,
            time: vec![0.0, 0.01, 0.02],
            qpos: Table::new(pose.repeat(3), 7).expect("whole rows"),
            qvel: still(3, 6).expect("whole rows"),
            ctrl: still(2, 1).expect("whole rows"),
            push: still(2, 6).expect("whole rows"),
            x: still(3, 1).expect("whole rows"),
            wrench: still(3, 6).expect("whole rows"),
            hydrostatic: still(3, 6).expect("whole rows"),
        };
        let calm = bounds(&mut PointMass::new(1.0, 0.002), &Water::OfTheScene, &run);
        assert_eq!(calm.speed.reached, 0.0);
        let mut broken = PointMass::new(1.0, 0.002);
        broken.break_at(0.011);
        let broken = bounds(&mut broken, &Water::OfTheScene, &run);
        assert_eq!(broken.speed.reached, f64::INFINITY);
        // The wrench that a law gives counts as the scene's own does.
        let law = |_: &hydro_frames::Twist, density: f64| Wrench {
            force: [0.0, 0.003 * density, 0.0],
            torque: [0.0, 0.0, 0.5],
        };
        let pulled = bounds(
            &mut PointMass::new(1.0, 0.002),
            &Water::Law(Box::new(law)),
            &run,
        );
        assert!((pulled.force.reached - 3.0).abs() < 1e-12);
        assert!((pulled.torque.reached - 0.5).abs() < 1e-12);
        assert!(
            (pulled.speed.reached - 3.0 * 0.02).abs() < 1e-12,
            "{pulled:?}"
        );
    }

    #[test]
    fn a_run_that_diverged_is_out_of_bounds_however_calm_it_was_later() {
        let mut peaks = [0.0; 4];
        keep_peaks(
            &mut peaks,
            &[f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0],
            Wrench::default(),
        );
        keep_peaks(
            &mut peaks,
            &[1.0, 0.0, 0.0, 0.0, 2.0, 0.0],
            Wrench::default(),
        );
        assert_eq!(peaks[..2], [f64::INFINITY, 2.0]);
        let fine = Peak {
            reached: 1.4,
            truth: 1.0,
        };
        let gone = Peak {
            reached: f64::INFINITY,
            truth: 1.0,
        };
        let bounds = Bounds {
            duration: 600.0,
            speed: fine,
            rate: fine,
            force: fine,
            torque: fine,
        };
        assert!(bounds.within(1.5) && !bounds.within(1.3));
        assert!(
            !Bounds {
                speed: gone,
                ..bounds
            }
            .within(1e300)
        );
    }

    #[test]
    fn bounds_are_the_others_or_the_truths_whichever_are_wider() {
        let of = |torque: Option<f64>| [Some(1.0), Some(1.4), Some(0.5), torque];
        let oracle = of(Some(1.6));
        assert!(within(&of(Some(2.3)), &oracle, 1.5));
        assert!(!within(&of(Some(2.5)), &oracle, 1.5));
        assert!(!within(&of(None), &oracle, 1.5), "it blew up");
        // An oracle that is calmer than the truth narrows nothing, and one that blew up widens nothing.
        for other in [Some(0.1), None] {
            assert!(within(&of(Some(1.4)), &of(other), 1.5));
            assert!(!within(&of(Some(1.6)), &of(other), 1.5));
        }
    }
}
