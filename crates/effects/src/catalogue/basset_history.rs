//! Basset's history force: viscous memory of past acceleration, `F = -c int a(s) / sqrt(t - s) ds`.

use super::axes;
use crate::{
    Card, Effect, Id, Medium, Parameter, Part, Physical, Placement, Target, TargetKind,
    dual::{Scalar, constant},
    flow::Flow,
    wrench_law::{Parameters, WrenchLaw, about_origin},
};

/// Rates [1/s] and weights [s^-1/2] of exponentials whose sum is 1/sqrt(t).
///
/// Geometric rates, weights by least squares on the kernel and on its integral together: both are within
/// 0.7 % from 5 ms to 20 s (tested below); after that the memory fades. All weights are positive, so that
/// the force takes out more energy than it gives back, whatever the motion.
const EXPONENTIALS: [(f64, f64); 8] = [
    (0.017_270_431_96, 0.261_205_578_2),
    (0.082_582_094_75, 0.194_708_250_6),
    (0.394_883_138_4, 0.569_901_395_3),
    (1.888_214_309, 1.208_122_931),
    (9.028_882_042, 2.650_293_469),
    (43.173_441_99, 5.826_663_930),
    (206.442_623_2, 12.359_359_97),
    (987.147_530_9, 51.367_712_13),
];
const COUNT: usize = EXPONENTIALS.len();

/// Places in the memory: one after the first step, else zero; time [s] and velocity [m/s] of the last step; the filtered
/// velocities, 3 x 8, axis by axis.
const STARTED: usize = 0;
const TIME: usize = 1;
const VELOCITY: usize = 2;
const FILTERED: usize = 5;

/// Prior, as a share of the drag.
const TYPICAL: f64 = 0.25;
/// Bound, in masses of the body and the displaced water [1/s^1/2].
const GREATEST: f64 = 100.0;

/// Parameters `surge`, `sway`, `heave` [kg/s^0.5]; for a sphere of radius r in a laminar flow
/// all are 6 r^2 sqrt(pi rho mu).
///
/// It starts as if the first velocity had lasted for ever.
#[derive(Debug)]
pub struct BassetHistory;

static CARD: Card = Card {
    id: Id::BassetHistory,
    phrase: "a Basset history force",
    target: TargetKind::Body,
    summary: "viscous memory of past acceleration",
    equation: "F = -c int a(s) / sqrt(t - s) ds, a the rate of nu_r's components, diagonal, at the middle of \
               the body, in its frame; kernel as eight exponentials, 5 ms to 20 s",
    source: "A. B. Basset, A Treatise on Hydrodynamics, vol. 2, 1888; M. R. Maxey and J. J. Riley, Physics of \
             Fluids 26, 1983; exponentials as in M. A. T. van Hinsberg et al., Journal of Computational \
             Physics 230, 2011",
    idealised: true,
    placement: Placement::Plugin,
};

impl Effect for BassetHistory {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        target.body().map_or_else(Vec::new, |scale| {
            // Comparable with drag after the time in which the body moves by its own length.
            let moment = (scale.length() / scale.typical_speed()).sqrt();
            let bound = GREATEST * (scale.typical_mass() + scale.displaced());
            (0..3)
                .map(|axis| {
                    let prior_sd = (TYPICAL * scale.linear_drag(axis) * moment).min(0.5 * bound);
                    Parameter::about(axes::NAMES[axis], "kg/s^0.5", 0.0, prior_sd)
                        .within(0.0, bound)
                        .physically(Physical::NotNegative)
                })
                .collect()
        })
    }

    fn presupposes(&self) -> &'static [Id] {
        Id::DRAGS
    }

    fn medium(&self) -> Medium {
        Medium::Water
    }

    fn part(&self) -> Part<'_> {
        Part::Body(self)
    }
}

/// Filtered velocity, z' = rate (v - z), brought over a time in which v goes from `before` to `now` along a
/// straight line: exact. The part that decays and the two shares of the line add up to one.
fn bring<D: Scalar>(filtered: D, rate: f64, elapsed: f64, before: D, now: D) -> D {
    let x = rate * elapsed;
    let decay = (-x).exp();
    // (1 - exp(-x)) / x, which for small x has a series.
    let mean = if x < 1e-6 {
        1.0 - 0.5 * x
    } else {
        (1.0 - decay) / x
    };
    filtered * decay + before * (mean - decay) + now * (1.0 - mean)
}

/// Time since the memory was last brought up, and the velocity then.
fn since<D: Scalar>(flow: &Flow<D>, memory: &[f64]) -> f64 {
    (flow.time() - memory[TIME]).max(0.0)
}

impl WrenchLaw for BassetHistory {
    const MEMORY_LEN: usize = FILTERED + 3 * COUNT;

    /// `int exp(-rate (t - s)) a ds` is v - z. The memory holds z at the start of the last step; it is brought to the
    /// present time here, so that the force is right at any time within a step.
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, memory: &[f64]) -> [D; 6] {
        let mut force = [D::from(0.0); 3];
        if memory[STARTED] > 0.5 {
            let elapsed = since(flow, memory);
            let now = flow.linear_at_middle();
            for (index, (rate, weight)) in EXPONENTIALS.into_iter().enumerate() {
                for axis in 0..3 {
                    let filtered = bring(
                        D::from(memory[FILTERED + axis * COUNT + index]),
                        rate,
                        elapsed,
                        D::from(memory[VELOCITY + axis]),
                        now[axis],
                    );
                    force[axis] -= p[axis] * (now[axis] - filtered) * weight;
                }
            }
        }
        about_origin(force, [D::from(0.0); 3], constant(flow.middle()))
    }

    fn advance_memory(
        &self,
        _p: &Parameters<f64>,
        flow: &Flow<f64>,
        _step: f64,
        memory: &mut [f64],
    ) {
        let now = flow.linear_at_middle();
        if memory[STARTED] > 0.5 {
            let elapsed = since(flow, memory);
            for axis in 0..3 {
                let before = memory[VELOCITY + axis];
                for (index, (rate, _)) in EXPONENTIALS.into_iter().enumerate() {
                    let filtered = &mut memory[FILTERED + axis * COUNT + index];
                    *filtered = bring(*filtered, rate, elapsed, before, now[axis]);
                }
            }
        } else {
            for (axis, &now) in now.iter().enumerate() {
                memory[FILTERED + axis * COUNT..][..COUNT].fill(now);
            }
        }
        memory[STARTED] = 1.0;
        memory[TIME] = flow.time();
        memory[VELOCITY..FILTERED].copy_from_slice(&now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyPart;
    use crate::tests::fixture;

    #[test]
    fn the_exponentials_are_the_kernel_over_the_window() {
        let mut t = 0.005_f64;
        while t < 20.0 {
            let kernel: f64 = EXPONENTIALS
                .iter()
                .map(|(rate, weight)| weight * (-rate * t).exp())
                .sum();
            assert!((kernel * t.sqrt() - 1.0).abs() < 7e-3, "at {t} s: {kernel}");
            t *= 1.02;
        }
    }

    /// Force under a velocity that is a function of time, for a unit coefficient.
    fn force(velocity: impl Fn(f64) -> f64, step: f64, until: f64) -> f64 {
        let mut motion = fixture::still();
        let mut memory = vec![0.0; BodyPart::memory_len(&BassetHistory)];
        let steps = (until / step).round() as usize;
        for index in 0..=steps {
            motion.time = index as f64 * step;
            motion.linear = [velocity(motion.time), 0.0, 0.0];
            if index < steps {
                BassetHistory.advance(&[1.0; 3], &motion, step, &mut memory);
            }
        }
        BassetHistory.wrench(&[1.0; 3], &motion, &memory)[0]
    }

    /// int_0^t a / sqrt(t - s) ds = 2 a sqrt(t).
    #[test]
    fn constant_acceleration_gives_two_a_root_t() {
        for step in [0.002, 0.01] {
            for until in [0.05, 0.3, 1.0, 5.0, 18.0] {
                let found = force(|t| 0.3 * t, step, until);
                let expected = -2.0 * 0.3 * until.sqrt();
                assert!(
                    (found / expected - 1.0).abs() < 8e-3,
                    "{found} for {expected} at {until} s in steps of {step} s"
                );
            }
        }
    }

    /// Against quadrature, with the substitution s = t - q^2 that takes the singularity out.
    #[test]
    fn an_oscillation_agrees_with_quadrature() {
        let omega = 5.0_f64;
        for until in [0.7, 3.1, 12.0] {
            let found = force(|t| (omega * t).sin(), 0.002, until);
            let count = 200_000;
            let width = until.sqrt() / f64::from(count);
            let integral: f64 = (0..count)
                .map(|index| {
                    let q = (f64::from(index) + 0.5) * width;
                    2.0 * omega * (omega * (until - q * q)).cos() * width
                })
                .sum();
            // Amplitude of the steady oscillation: omega sqrt(pi / omega).
            let amplitude = (omega * std::f64::consts::PI).sqrt();
            assert!(
                (found + integral).abs() < 8e-3 * amplitude,
                "{found} {integral}"
            );
        }
    }

    #[test]
    fn at_constant_velocity_there_is_no_force() {
        assert!(force(|_| 0.8, 0.01, 3.0).abs() < 1e-12);
    }
}
