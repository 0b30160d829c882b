//! Prescribed motion: joints that follow a measured trajectory, so that the forces are the output.

/// Samples that a spline needs.
pub const LEAST_SAMPLES: usize = 4;

/// Position, velocity and acceleration of a joint [m or rad, per s, per s^2].
pub type Moment = [f64; 3];

/// A joint whose motion is imposed.
#[derive(Clone, Debug, PartialEq)]
pub struct PrescribedJoint {
    /// Its name.
    pub name: String,
    /// Index of its position in `qpos`.
    pub qpos: usize,
    /// Index of its velocity in `qvel`.
    pub dof: usize,
    /// Its motion.
    pub course: Course,
}

/// The motion of a joint against time.
#[derive(Clone, Debug, PartialEq)]
pub enum Course {
    /// A cubic spline through samples.
    Spline(Spline),
    /// States that have nothing to do with each other, each at constant velocity about its own time [s].
    Steady {
        /// When each state is taken [s], ascending.
        times: Vec<f64>,
        /// Position and velocity at that time.
        states: Vec<[f64; 2]>,
    },
}

/// The imposed motion of a trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrescribedMotion {
    /// Hinges and slides.
    pub joints: Vec<PrescribedJoint>,
    /// True where every other degree of freedom stands still where it is.
    pub holds_the_rest: bool,
}

impl PrescribedMotion {
    /// True where a degree of freedom is imposed.
    pub fn imposes(&self, dof: usize) -> bool {
        self.holds_the_rest || self.joints.iter().any(|joint| joint.dof == dof)
    }

    /// The same motion in a model whose joints have other places; `None` where it lacks one.
    pub fn placed(&self, place: impl Fn(&str) -> Option<(usize, usize)>) -> Option<Self> {
        let joints = self.joints.iter().map(|joint| {
            let (qpos, dof) = place(&joint.name)?;
            Some(PrescribedJoint {
                qpos,
                dof,
                ..joint.clone()
            })
        });
        Some(Self {
            joints: joints.collect::<Option<_>>()?,
            holds_the_rest: self.holds_the_rest,
        })
    }

    /// Writes the imposed positions and velocities at a time [s]. Where the rest is held, its velocities become zero.
    pub fn impose(&self, time: f64, qpos: &mut [f64], qvel: &mut [f64]) {
        if self.holds_the_rest {
            qvel.fill(0.0);
        }
        for joint in &self.joints {
            let [position, velocity, _] = joint.course.at(time);
            qpos[joint.qpos] = position;
            qvel[joint.dof] = velocity;
        }
    }

    /// Imposed accelerations at a time [s], by degree of freedom.
    pub fn accelerations(&self, time: f64, nv: usize) -> Vec<(usize, f64)> {
        let mut all: Vec<(usize, f64)> = match self.holds_the_rest {
            true => (0..nv).map(|dof| (dof, 0.0)).collect(),
            false => self.joints.iter().map(|joint| (joint.dof, 0.0)).collect(),
        };
        for joint in &self.joints {
            let [_, _, acceleration] = joint.course.at(time);
            for (dof, value) in &mut all {
                if *dof == joint.dof {
                    *value = acceleration;
                }
            }
        }
        all
    }
}

impl Course {
    /// Position, velocity and acceleration at a time [s].
    pub fn at(&self, time: f64) -> Moment {
        match self {
            Self::Spline(spline) => spline.at(time),
            Self::Steady { times, states } => {
                let after = times.partition_point(|of| *of <= time);
                let nearest = match (after.checked_sub(1), times.get(after)) {
                    (Some(before), Some(next)) if next - time < time - times[before] => after,
                    (Some(before), _) => before,
                    (None, _) => 0,
                };
                let [position, velocity] = states.get(nearest).copied().unwrap_or_default();
                let since = time - times.get(nearest).copied().unwrap_or(time);
                [position + velocity * since, velocity, 0.0]
            }
        }
    }
}

/// A cubic spline through samples, twice continuously differentiable. Its third derivative is continuous at the second sample
/// and the last but one (C. de Boor, A Practical Guide to Splines, Springer 1978, chapter IV: not-a-knot). Before the first
/// sample and after the last it goes on at constant velocity.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    times: Vec<f64>,
    values: Vec<f64>,
    /// Second derivatives at the samples.
    bends: Vec<f64>,
}

impl Spline {
    /// Through samples at ascending times [s]; `None` with fewer than [`LEAST_SAMPLES`].
    pub fn through(times: &[f64], values: &[f64]) -> Option<Self> {
        let n = times.len();
        if n < LEAST_SAMPLES || values.len() != n {
            return None;
        }
        let h: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let slope: Vec<f64> = (values.windows(2).zip(&h))
            .map(|(pair, h)| (pair[1] - pair[0]) / h)
            .collect();
        // Equations of the inner second derivatives; the outer ones follow from the first and the last pair of intervals:
        // m[0] = m[1] - (m[2] - m[1]) h[0] / h[1], and likewise at the end.
        let inner = n - 2;
        let (mut below, mut diagonal, mut above) =
            (vec![0.0; inner], vec![0.0; inner], vec![0.0; inner]);
        let mut right = vec![0.0; inner];
        for row in 0..inner {
            below[row] = h[row];
            diagonal[row] = 2.0 * (h[row] + h[row + 1]);
            above[row] = h[row + 1];
            right[row] = 6.0 * (slope[row + 1] - slope[row]);
        }
        let (first, last) = (h[0] / h[1], h[n - 2] / h[n - 3]);
        diagonal[0] += h[0] * (1.0 + first);
        above[0] -= h[0] * first;
        diagonal[inner - 1] += h[n - 2] * (1.0 + last);
        below[inner - 1] -= h[n - 2] * last;
        for row in 1..inner {
            let factor = below[row] / diagonal[row - 1];
            diagonal[row] -= factor * above[row - 1];
            right[row] -= factor * right[row - 1];
        }
        let mut bends = vec![0.0; n];
        for row in (0..inner).rev() {
            let next = if row + 1 < inner { bends[row + 2] } else { 0.0 };
            bends[row + 1] = (right[row] - above[row] * next) / diagonal[row];
        }
        bends[0] = bends[1] - first * (bends[2] - bends[1]);
        bends[n - 1] = bends[n - 2] + last * (bends[n - 2] - bends[n - 3]);
        Some(Self {
            times: times.to_vec(),
            values: values.to_vec(),
            bends,
        })
    }

    /// Position, velocity and acceleration at a time [s].
    pub fn at(&self, time: f64) -> Moment {
        let n = self.times.len();
        let inside = time.clamp(self.times[0], self.times[n - 1]);
        let at = (self.times.partition_point(|of| *of <= inside)).clamp(1, n - 1) - 1;
        let h = self.times[at + 1] - self.times[at];
        let part = (inside - self.times[at]) / h;
        let rest = 1.0 - part;
        let (a, b) = (self.bends[at], self.bends[at + 1]);
        let (from, to) = (self.values[at], self.values[at + 1]);
        let position = rest * from
            + part * to
            + h * h / 6.0 * ((rest.powi(3) - rest) * a + (part.powi(3) - part) * b);
        let velocity = (to - from) / h
            + h / 6.0 * ((1.0 - 3.0 * rest * rest) * a + (3.0 * part * part - 1.0) * b);
        if inside != time {
            return [position + velocity * (time - inside), velocity, 0.0];
        }
        [position, velocity, rest * a + part * b]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A cubic is its own not-a-knot spline, at uneven samples too, with its derivatives.
    #[test]
    fn a_spline_through_a_cubic_is_that_cubic() {
        let cubic = |t: f64| 0.3 - 1.2 * t + 0.7 * t * t - 0.4 * t.powi(3);
        for times in [
            vec![0.0, 0.1, 0.35, 0.5],
            vec![-1.0, 0.0, 0.4, 0.5, 1.5, 2.0],
        ] {
            let values: Vec<f64> = times.iter().map(|t| cubic(*t)).collect();
            let spline = Spline::through(&times, &values).unwrap();
            for part in 0..=40 {
                let (first, last) = (times[0], times[times.len() - 1]);
                let t = first + (last - first) * f64::from(part) / 40.0;
                let expected = [cubic(t), -1.2 + 1.4 * t - 1.2 * t * t, 1.4 - 2.4 * t];
                for (found, expected) in spline.at(t).iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-11, "{t} {found} {expected}");
                }
            }
        }
        assert!(Spline::through(&[0.0, 1.0, 2.0], &[0.0; 3]).is_none());
    }

    #[test]
    fn a_spline_has_no_jump_in_its_acceleration_and_goes_on_straight() {
        let times: Vec<f64> = (0..30).map(|row| 0.1 * f64::from(row)).collect();
        let values: Vec<f64> = times.iter().map(|t| (3.0 * t).sin()).collect();
        let spline = Spline::through(&times, &values).unwrap();
        for time in &times[1..29] {
            let [before, after] = [-1e-9, 1e-9].map(|shift| spline.at(time + shift));
            for (a, b) in before.iter().zip(after) {
                assert!((a - b).abs() < 1e-6, "{time} {before:?} {after:?}");
            }
            assert!((spline.at(*time)[2] + 9.0 * (3.0 * time).sin()).abs() < 0.3);
        }
        let [end, speed, _] = spline.at(times[29]);
        let beyond = spline.at(times[29] + 0.5);
        assert!((beyond[0] - end - 0.5 * speed).abs() < 1e-12);
        assert_eq!(beyond[1..], [speed, 0.0]);
    }

    #[test]
    fn steady_states_know_nothing_of_each_other() {
        let course = Course::Steady {
            times: vec![1.0, 2.0, 7.0],
            states: vec![[0.1, 2.0], [5.0, 0.0], [-1.0, -4.0]],
        };
        assert_eq!(course.at(1.0), [0.1, 2.0, 0.0]);
        assert_eq!(course.at(2.0), [5.0, 0.0, 0.0]);
        assert_eq!(course.at(2.01), [5.0, 0.0, 0.0]);
        assert_eq!(course.at(7.25), [-2.0, -4.0, 0.0]);
        assert_eq!(course.at(0.5), [-0.9, 2.0, 0.0]);
    }
}
