//! Fluctuation of a predicted force: its power at frequencies where the true force has almost none.

use rustfft::{FftPlanner, num_complex::Complex};

use crate::dataset::Split;

/// Share of the true power below the truth's bandwidth.
const INSIDE: f64 = 0.99;

/// Power by frequency, mean taken off, Hann window; the first half of the spectrum.
fn spectrum(planner: &mut FftPlanner<f64>, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let values: Vec<f64> = values.collect();
    let (count, mean) = (
        values.len(),
        values.iter().sum::<f64>() / values.len() as f64,
    );
    let mut line: Vec<Complex<f64>> = values
        .iter()
        .enumerate()
        .map(|(k, value)| {
            let turn = std::f64::consts::TAU * (k as f64 + 0.5) / count as f64;
            Complex::new((value - mean) * 0.5 * (1.0 - turn.cos()), 0.0)
        })
        .collect();
    planner.plan_fft_forward(count).process(&mut line);
    line[1..=count / 2].iter().map(Complex::norm_sqr).collect()
}

/// Power above the truth's bandwidth (that holds 99 % of the true power of an axis, over all trajectories), predicted over
/// true; the mean over axes weighs each by its true power. 1 is as calm as the truth. None where the truth has no power there.
pub(super) fn fluctuation(split: &Split, forces: &[Vec<f64>]) -> Option<f64> {
    let (f, mut planner) = (split.outputs(), FftPlanner::new());
    let bins = split.samples() / 2;
    let (mut predicted, mut actual) = (0.0, 0.0);
    for axis in 0..f {
        let (mut model, mut truth) = (vec![0.0; bins], vec![0.0; bins]);
        for (index, forces) in forces.iter().enumerate() {
            let clean = split.clean(index).iter().map(|value| f64::from(*value));
            let columns: [(&mut Vec<f64>, Vec<f64>); 2] = [
                (
                    &mut model,
                    spectrum(&mut planner, forces.iter().skip(axis).step_by(f).copied()),
                ),
                (
                    &mut truth,
                    spectrum(&mut planner, clean.skip(axis).step_by(f)),
                ),
            ];
            for (total, part) in columns {
                total
                    .iter_mut()
                    .zip(part)
                    .for_each(|(total, part)| *total += part);
            }
        }
        let whole: f64 = truth.iter().sum();
        if whole <= 0.0 {
            continue;
        }
        let mut below = 0.0;
        let edge = truth.iter().position(|power| {
            below += power;
            below >= INSIDE * whole
        });
        let above = edge.map_or(bins, |edge| edge + 1);
        predicted += model[above..].iter().sum::<f64>() / whole;
        actual += truth[above..].iter().sum::<f64>() / whole;
    }
    (actual > 0.0).then(|| predicted / actual)
}
