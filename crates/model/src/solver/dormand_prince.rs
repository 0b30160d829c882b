//! The method of Dormand and Prince with adaptive steps: order 5, with an embedded method of order 4 that estimates the
//! error of a step.
//!
//! J. R. Dormand, P. J. Prince, "A family of embedded Runge-Kutta formulae", J. Comput. Appl. Math. 6(1), 1980;
//! step-size control after E. Hairer, S. P. Norsett, G. Wanner, "Solving Ordinary Differential Equations I",
//! section II.4:
//!
//! ```text
//! k_i = f(F + s sum_{j<i} a_ij k_j),   F' = F + s sum_i b_i k_i,   e = s sum_i (b_i - b^_i) k_i          i = 1 .. 7
//! |e| = sqrt(mean over components of (e / (ABSOLUTE + RELATIVE max(|F|, |F'|)))^2),   accepted where |e| <= 1
//! s' = s min(5, max(0.2, 0.9 |e|^(-1/5))),   no growth right after a rejected step
//! ```
//!
//! The step s is a fraction of the sample period, over which h is held. The first step tried in a period is the whole
//! period: no step size is carried from sample to sample, so a simulation stores nothing more, and a field that one step
//! solves costs seven evaluations. The last row of a is b, so k_7 is k_1 of the next step.
//!
//! The steps of a trajectory depend on that trajectory alone, and the matrix products give the same numbers for one row
//! and for many; a trajectory is therefore the same, bit for bit, whichever others are integrated in the same batch.

use crate::kernel::Real;

/// Evaluations of a step with its error estimate.
pub(crate) const STAGES: usize = 7;

/// Stages that F' is computed from: all but the last.
pub(crate) const WEIGHED: usize = 6;

/// a_ij, row by row.
pub(crate) const A: [&[f64]; STAGES] = [
    &[],
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
    ],
    &[
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
    ],
    &B,
];

/// b_i, without the last one, which is zero.
pub(crate) const B: [f64; WEIGHED] = [
    35.0 / 384.0,
    0.0,
    500.0 / 1113.0,
    125.0 / 192.0,
    -2187.0 / 6784.0,
    11.0 / 84.0,
];

/// b_i - b^_i.
pub(crate) const ERROR: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// Relative tolerance of a step: far below the error of a learned field (hundredths), and far above the rounding of f32
/// (1e-7), which would otherwise reject steps.
const RELATIVE: f64 = 1e-4;

/// Absolute tolerance of a step [standard deviations of the force].
const ABSOLUTE: f64 = 1e-5;

/// Greatest number of steps tried in a sample period. The rest of the period is then one step, whatever its error, so
/// that neither a stiff field nor NaN stalls a simulation.
const TRIES: usize = 64;

const SAFETY: f64 = 0.9;
const LEAST_GROWTH: f64 = 0.2;
const MOST_GROWTH: f64 = 5.0;

/// A remainder of the period up to this fraction of the step is added to the last step instead of being a step of its own.
const STRETCH: f64 = 0.01;

/// Progress of one trajectory through a sample period.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Clock {
    /// Index of the trajectory.
    row: usize,
    /// Remainder of the period, as a fraction.
    left: f64,
    /// Current step, as a fraction of the period.
    step: f64,
    tries: usize,
    /// True if the last step tried was rejected.
    refused: bool,
}

impl Clock {
    /// The beginning of a period.
    pub(crate) fn start(row: usize) -> Self {
        Self {
            row,
            left: 1.0,
            step: 1.0,
            tries: 0,
            refused: false,
        }
    }

    /// Current step, as a fraction of the period.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    /// True at the end of the period.
    pub(crate) fn is_over(&self) -> bool {
        self.left <= 0.0
    }

    /// Accepts (true) or rejects the current step by the norm of its error, and chooses the next one.
    pub(crate) fn judge(&mut self, norm: f64) -> bool {
        self.tries += 1;
        let accepted = norm <= 1.0 || self.tries > TRIES;
        let most = if accepted && !self.refused {
            MOST_GROWTH
        } else {
            1.0
        };
        let growth = if norm.is_finite() {
            (SAFETY * libm::pow(norm, -0.2)).clamp(LEAST_GROWTH, most)
        } else {
            LEAST_GROWTH
        };
        if accepted {
            self.left -= self.step;
        }
        self.refused = !accepted;
        self.step *= growth;
        if self.tries >= TRIES || self.left <= (1.0 + STRETCH) * self.step {
            self.step = self.left;
        }
        accepted
    }
}

/// |e| from (F, F', e) of every component.
pub(crate) fn norm(components: impl ExactSizeIterator<Item = (f64, f64, f64)>) -> f64 {
    let count = components.len() as f64;
    let squares = components.map(|(force, next, error)| {
        (error / (ABSOLUTE + RELATIVE * force.abs().max(next.abs()))).powi(2)
    });
    (squares.sum::<f64>() / count).sqrt()
}

/// sum_j w_j k_j of one component, with k_1 first in `slopes` and the next ones `stride` apart.
fn weigh<T: Real>(weights: &[f64], slopes: &[T], stride: usize) -> T {
    let mut sum = T::default();
    for (weight, slope) in weights.iter().zip(slopes.iter().step_by(stride)) {
        sum += T::real(*weight) * *slope;
    }
    sum
}

/// Force of a stage, F + s sum_j a_j k_j [f], with the row's k_1 first in `slopes` and the next ones `stride` apart.
pub(crate) fn lean<T: Real>(
    out: &mut [T],
    force: &[T],
    (a, step): (&[f64], T),
    slopes: &[T],
    stride: usize,
) {
    for (i, (out, force)) in out.iter_mut().zip(force).enumerate() {
        *out = *force + step * weigh(a, &slopes[i..], stride);
    }
}

/// Several trajectories over one sample period.
pub(crate) struct Period<'a, T> {
    /// F [rows, f]; afterwards F of the next sample.
    pub(crate) force: &'a mut [T],
    /// Input of the field [rows, inputs], the place of F followed by h. Finished rows are dropped and later ones move up,
    /// so with more than one row h is overwritten.
    pub(crate) input: &'a mut [T],
    /// Buffer for k [STAGES, rows, f].
    pub(crate) slopes: &'a mut [T],
    /// Buffer for [rows] clocks.
    pub(crate) clocks: &'a mut [Clock],
}

impl<T: Real> Period<'_, T> {
    /// Integrates to the end of the period. `evaluate` is the field of some rows; `taken` is called for every accepted
    /// step with the row, the step and F [f] at its start, round after round: in each round every unfinished row tries one
    /// step, in the order of the rows.
    pub(crate) fn run(
        self,
        mut evaluate: impl FnMut(&[T], &mut [T]),
        mut taken: impl FnMut(usize, T, &[T]),
    ) {
        let Self {
            force,
            input,
            slopes,
            clocks,
        } = self;
        let rows = clocks.len();
        let (outputs, inputs, stride) = (force.len() / rows, input.len() / rows, force.len());
        for (row, clock) in clocks.iter_mut().enumerate() {
            *clock = Clock::start(row);
        }
        for (input, force) in input
            .chunks_exact_mut(inputs)
            .zip(force.chunks_exact(outputs))
        {
            input[..outputs].copy_from_slice(force);
        }
        evaluate(input, &mut slopes[..stride]);
        let mut running = rows;
        while running > 0 {
            for (stage, a) in A.iter().enumerate().skip(1) {
                for (at, clock) in clocks[..running].iter().enumerate() {
                    let force = &force[clock.row * outputs..][..outputs];
                    let out = &mut input[at * inputs..][..outputs];
                    let step = T::real(clock.step());
                    lean(out, force, (a, step), &slopes[at * outputs..], stride);
                }
                let out = &mut slopes[stage * stride..][..running * outputs];
                evaluate(&input[..running * inputs], out);
            }
            let mut still = 0;
            for at in 0..running {
                let clock = &mut clocks[at];
                let force = &mut force[clock.row * outputs..][..outputs];
                // The input of the last stage is F at the end of the step.
                let next = &input[at * inputs..][..outputs];
                let step = T::real(clock.step());
                let components = force.iter().zip(next).enumerate().map(|(i, (now, next))| {
                    let error = step * weigh(&ERROR, &slopes[at * outputs + i..], stride);
                    (now.to_f64(), next.to_f64(), error.to_f64())
                });
                let accepted = clock.judge(norm(components));
                if accepted {
                    taken(clock.row, step, force);
                    force.copy_from_slice(next);
                }
                if !clock.is_over() {
                    let first = at * outputs + if accepted { WEIGHED * stride } else { 0 };
                    slopes.copy_within(first..first + outputs, still * outputs);
                    input.copy_within(at * inputs..(at + 1) * inputs, still * inputs);
                    clocks[still] = clocks[at];
                    still += 1;
                }
            }
            running = still;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};

    use super::*;

    /// Steps of each row, in the order taken, and the forces at the end of the period, for rows [F; h] of one h each.
    fn period(
        force: &[f64],
        held: &[f64],
        field: impl Fn(&[f64], &mut [f64]),
    ) -> (Vec<(usize, f64)>, Vec<f64>) {
        let (rows, outputs) = (held.len(), force.len() / held.len());
        let mut force = force.to_vec();
        let mut input: Vec<f64> = held
            .iter()
            .flat_map(|h| [vec![0.0; outputs], vec![*h]].concat())
            .collect();
        let mut steps = Vec::new();
        let period = Period {
            force: &mut force,
            input: &mut input,
            slopes: &mut vec![0.0; STAGES * rows * outputs],
            clocks: &mut vec![Clock::default(); rows],
        };
        let evaluate = |x: &[f64], y: &mut [f64]| {
            for (x, y) in x.chunks_exact(outputs + 1).zip(y.chunks_exact_mut(outputs)) {
                field(x, y);
            }
        };
        period.run(evaluate, |row, step, _| steps.push((row, step)));
        (steps, force)
    }

    #[test]
    fn the_tableau_is_consistent() {
        let nodes = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
        for (row, node) in A.iter().zip(nodes) {
            assert!((row.iter().sum::<f64>() - node).abs() < 1e-14, "{row:?}");
        }
        assert!(ERROR.iter().sum::<f64>().abs() < 1e-15);
    }

    /// dF/dt = F (1 - F) from 1/10, F = 1 / (1 + 9 e^-t): the error at t = 3 falls by 2^order when the step is halved.
    #[test]
    fn the_method_is_of_order_five_and_the_one_embedded_of_order_four() {
        let embedded: Vec<f64> = (0..STAGES)
            .map(|i| B.get(i).copied().unwrap_or(0.0) - ERROR[i])
            .collect();
        let error = |weights: &[f64], steps: u32| {
            let step = 3.0 / f64::from(steps);
            let mut force = [0.1];
            for _ in 0..steps {
                let mut slopes = [0.0; STAGES];
                for (stage, a) in A.iter().enumerate() {
                    let mut inner = [0.0];
                    lean(&mut inner, &force, (a, step), &slopes, 1);
                    slopes[stage] = inner[0] * (1.0 - inner[0]);
                }
                let now = force;
                lean(&mut force, &now, (weights, step), &slopes, 1);
            }
            (force[0] - 1.0 / (1.0 + 9.0 * (-3.0f64).exp())).abs()
        };
        for (weights, order) in [(&B[..], 5.0), (&embedded[..], 4.0)] {
            let observed = (error(weights, 32) / error(weights, 64)).log2();
            assert!((observed - order).abs() < 0.15, "order {observed}");
        }
    }

    /// dF/dt = h A F against the exponential of a matrix, in the tolerance, with more steps where h is larger.
    #[test]
    fn a_linear_field_is_solved_to_the_tolerance_by_as_many_steps_as_it_takes() {
        let matrix = Matrix2::new(-1.0, 2.0, -2.0, -0.5);
        let mut before = 0;
        for (rate, most) in [(0.05, 1), (1.0, 4), (10.0, 60)] {
            let (steps, force) = period(&[1.0, -0.5], &[rate], |x, y| {
                let slope = x[2] * matrix * Vector2::new(x[0], x[1]);
                y.copy_from_slice(slope.as_slice());
            });
            let exact = (rate * matrix).exp() * Vector2::new(1.0, -0.5);
            let off = (Vector2::new(force[0], force[1]) - exact).amax();
            // Errors of single steps add up.
            assert!(off < 2.0 * (ABSOLUTE + RELATIVE), "{rate}: {off}");
            let whole: f64 = steps.iter().map(|(_, step)| step).sum();
            assert!((whole - 1.0).abs() < 1e-12, "{rate}: {whole} of a period");
            assert!(
                steps.len() > before && steps.len() <= most,
                "{rate}: {steps:?}"
            );
            before = steps.len();
        }
    }

    /// Rows that take one step and many, in one product and alone: the same bits.
    #[test]
    fn a_trajectory_does_not_see_its_neighbours() {
        let field = |x: &[f64], y: &mut [f64]| {
            y[0] = x[2] * ((3.0 * x[1]).sin() - x[0]);
            y[1] = x[1].cos() - x[2] * x[0];
        };
        let held = [20.0, 0.0, 3.0, 0.1, 45.0, 1.0];
        let start: Vec<f64> = (0..12).map(|i| f64::from(i).cos()).collect();
        let (steps, force) = period(&start, &held, field);
        let mut counts = Vec::new();
        for (row, h) in held.iter().enumerate() {
            let (alone, end) = period(&start[2 * row..][..2], &[*h], field);
            assert_eq!(end, force[2 * row..][..2]);
            let beside = steps.iter().filter(|(whose, _)| *whose == row);
            assert!(alone.iter().map(|a| a.1).eq(beside.map(|b| b.1)));
            counts.push(alone.len());
        }
        counts.sort_unstable();
        counts.dedup();
        assert!(counts.len() > 3, "steps {counts:?}");
    }

    /// Fields that no step is short enough for: an end comes, and no other row is the worse for it.
    #[test]
    fn a_wild_field_keeps_nobody_waiting() {
        let evaluations = std::cell::Cell::new(0);
        let field = |x: &[f64], y: &mut [f64]| {
            evaluations.set(evaluations.get() + 1);
            y[0] = if x[1] > 0.0 {
                x[1] * x[0] * x[0]
            } else {
                -x[0]
            };
        };
        let calm = period(&[1.0], &[0.0], field).1;
        for (start, h) in [
            (1.0, 1e12),
            (1.0, f64::INFINITY),
            (f64::NAN, 1.0),
            (-1e200, 1e3),
        ] {
            evaluations.set(0);
            let (steps, force) = period(&[1.0, start], &[0.0, h], field);
            assert_eq!(force[0], calm[0]);
            assert!(steps.len() <= 1 + TRIES + steps.iter().filter(|s| s.0 == 0).count());
            assert!(evaluations.get() <= 2 * (1 + WEIGHED * (TRIES + 1)), "{h}");
        }
    }

    #[test]
    fn lengths_follow_the_error() {
        let judged = |norm| {
            let mut clock = Clock::start(0);
            clock.step = 0.01;
            let accepted = clock.judge(norm);
            (accepted, clock.step)
        };
        for (norm, accepted, step) in [
            (0.0, true, 0.05),
            (1.0, true, 0.009),
            (32.0, false, 0.0045),
            (1e30, false, 0.002),
            (f64::NAN, false, 0.002),
            (f64::INFINITY, false, 0.002),
        ] {
            let (found, length) = judged(norm);
            assert_eq!(found, accepted, "{norm}");
            assert!((length - step).abs() < 1e-12, "{norm}: {length}");
        }
        // Not longer right after a refusal, and again after that.
        let mut clock = Clock::start(0);
        assert!(!clock.judge(f64::NAN));
        for expected in [0.2, 0.6] {
            assert!(clock.judge(0.0));
            assert!((clock.step() - expected).abs() < 1e-12, "{}", clock.step());
        }
        assert!(clock.judge(0.0) && clock.is_over());
    }
}
