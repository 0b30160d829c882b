//! Relaxation towards a moving target, as one differentiable operation.
//!
//! ```text
//! F_k = F_{k-1} + s_k (G_k - F_{k-1}),  k = 1 .. S
//! ```
//!
//! with s = 1 - e^(-K Dt) the exact step of dF/dt = K (G - F) whose K and G are held over it. Backward, with
//! g_k = dL/dF_k of all that comes later:
//!
//! ```text
//! dL/dG_k = s_k g_k,   dL/ds_k = (G_k - F_{k-1}) g_k,   g_{k-1} += (1 - s_k) g_k
//! ```
//!
//! Each step is an affine map of F, and affine maps compose associatively; where there are no kernels the
//! trajectory is therefore a parallel scan in tensor operations (W. D. Hillis and G. L. Steele, "Data Parallel
//! Algorithms", CACM 29(12), 1986).

use candle_core::{Result, Shape, Tensor};

use super::{
    backend::Backend,
    custom_operation::{BackwardPass, Operation, apply_3, values},
};
use crate::kernel::Real;

/// F_0 [B, f], s [B, S, f], G [B, S, f] -> F [B, S+1, f].
pub(crate) fn relax(
    operations: Backend,
    start: &Tensor,
    share: &Tensor,
    target: &Tensor,
) -> Result<Tensor> {
    match operations {
        Backend::Kernels => apply_3(Relaxation, [start, share, target]),
        Backend::Tensors => scan(start, share, target),
    }
}

/// Step k as F -> a F + b; doubling the span of each map until all reach back to F_0.
fn scan(start: &Tensor, share: &Tensor, target: &Tensor) -> Result<Tensor> {
    let (batch, steps, width) = share.dims3()?;
    let mut keep = share.affine(-1.0, 1.0)?;
    let mut add = (share * target)?;
    let mut span = 1;
    while span < steps {
        let shape = (batch, span, width);
        let (one, zero) = (
            Tensor::ones(shape, share.dtype(), share.device())?,
            Tensor::zeros(shape, share.dtype(), share.device())?,
        );
        let earlier = |maps: &Tensor, fill: &Tensor| {
            Tensor::cat(&[fill, &maps.narrow(1, 0, steps - span)?], 1)
        };
        add = (&add + (&keep * earlier(&add, &zero)?)?)?;
        keep = (&keep * earlier(&keep, &one)?)?;
        span *= 2;
    }
    let start = start.unsqueeze(1)?;
    let later = keep.broadcast_mul(&start)?.add(&add)?;
    Tensor::cat(&[start, later], 1)
}

struct Relaxation;

fn forward<T: Real>(start: &[T], share: &[T], target: &[T], steps: usize, width: usize) -> Vec<T> {
    let mut forces = Vec::with_capacity(start.len() * (steps + 1));
    for ((start, share), target) in start
        .chunks_exact(width)
        .zip(share.chunks_exact(steps * width))
        .zip(target.chunks_exact(steps * width))
    {
        forces.extend_from_slice(start);
        for (share, target) in share.iter().zip(target) {
            let before = forces[forces.len() - width];
            forces.push(before + *share * (*target - before));
        }
    }
    forces
}

/// Gradients of F_0, s and G.
fn backward<T: Real>(
    [share, target, forces, gradient]: [&[T]; 4],
    steps: usize,
    width: usize,
) -> [Vec<T>; 3] {
    let batch = share.len() / (steps * width);
    let mut d_start = Vec::with_capacity(batch * width);
    let mut d_share = vec![T::default(); share.len()];
    let mut d_target = vec![T::default(); share.len()];
    for row in 0..batch {
        let (inner, outer) = (row * steps * width, row * (steps + 1) * width);
        let mut later = vec![T::default(); width];
        for step in (0..steps).rev() {
            for (axis, later) in later.iter_mut().enumerate() {
                let at = inner + step * width + axis;
                let (before, after) = (
                    outer + step * width + axis,
                    outer + (step + 1) * width + axis,
                );
                *later += gradient[after];
                d_target[at] = share[at] * *later;
                d_share[at] = (target[at] - forces[before]) * *later;
                *later -= share[at] * *later;
            }
        }
        d_start.extend(
            later
                .iter()
                .zip(&gradient[outer..])
                .map(|(later, own)| *later + *own),
        );
    }
    [d_start, d_share, d_target]
}

impl Operation<3> for Relaxation {
    const NAME: &'static str = "force-relaxation";

    fn shape(&self, [_, share, _]: [&Shape; 3]) -> Result<Shape> {
        let (batch, steps, width) = share.dims3()?;
        Ok((batch, steps + 1, width).into())
    }

    fn forward<T: Real>(
        &self,
        [start, share, target]: [&[T]; 3],
        [_, shape, _]: [&Shape; 3],
    ) -> Result<Vec<T>> {
        let (_, steps, width) = shape.dims3()?;
        Ok(forward(start, share, target, steps, width))
    }

    fn backward<T: Real>(&self, pass: &BackwardPass<'_, 3>) -> Result<[Option<Vec<T>>; 3]> {
        let [_, share, target] = pass.arguments;
        let (_, steps, width) = share.dims3()?;
        let (share, target) = (values::<T>(share)?, values::<T>(target)?);
        let (forces, gradient) = (values::<T>(pass.result)?, values::<T>(pass.gradient)?);
        Ok(backward([&share, &target, &forces, &gradient], steps, width).map(Some))
    }
}

#[cfg(test)]
mod tests {
    use candle_core::{Device, Var};

    use super::*;
    use crate::testing::numbers;
    use crate::testing::{ramp, weighted};

    #[test]
    fn a_held_target_is_approached_as_the_closed_form_says() {
        let (rate, target, start, steps) = (0.3f64, 5.0, -2.0, 40);
        let shape = (1, steps, 1);
        let share = Tensor::full(1.0 - (-rate).exp(), shape, &Device::Cpu).expect("made");
        let goal = Tensor::full(target, shape, &Device::Cpu).expect("made");
        let begin = Tensor::full(start, (1, 1), &Device::Cpu).expect("made");
        for operations in [Backend::Kernels, Backend::Tensors] {
            let forces = numbers(&relax(operations, &begin, &share, &goal).expect("runs"));
            for (k, force) in forces.iter().enumerate() {
                let exact = target + (start - target) * (-rate * k as f64).exp();
                assert!((force - exact).abs() < 1e-12, "{operations:?} {k}: {force}");
            }
        }
    }

    #[test]
    fn the_kernel_and_the_scan_agree_with_their_gradients() {
        for steps in [1, 2, 7, 37] {
            let vars = [
                Var::from_tensor(&ramp(&[3, 2], 0.9)).expect("a variable"),
                Var::from_tensor(&ramp(&[3, steps, 2], 0.53)).expect("a variable"),
                Var::from_tensor(&ramp(&[3, steps, 2], 1.7)).expect("a variable"),
            ];
            let run = |operations| {
                let forces = relax(operations, &vars[0], &vars[1], &vars[2]).expect("runs");
                let gradients = weighted(&forces).backward().expect("derives");
                let mut found = numbers(&forces);
                for var in &vars {
                    found.extend(numbers(gradients.get(var).expect("a gradient")));
                }
                found
            };
            let (kernel, scan) = (run(Backend::Kernels), run(Backend::Tensors));
            assert_eq!(kernel.len(), scan.len());
            for (a, b) in kernel.iter().zip(&scan) {
                assert!((a - b).abs() < 1e-12, "{steps} steps: {a} against {b}");
            }
        }
    }
}
