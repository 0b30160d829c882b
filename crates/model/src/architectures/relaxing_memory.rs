//! Memory of a Relaxation-ODE: hidden numbers that relax, each to a target at a rate, both of the motion alone.
//!
//! ```text
//! dm_i/dt = softplus(lambda_i) / Dt (G_i(h) - m_i),   [G; lambda] = B h + network(h) - [0; 0, .., 7 (M - 1) / M]
//! m_k = m_{k-1} + sigmoid(lambda_k) (G_k - m_{k-1})                    the exact step, as in `relaxation_ode.rs`
//! ```
//!
//! Such are the wakes of a strip theory: numbers of the water that follow the motion and that the force reads. Since neither rates nor targets
//! depend on m, a trajectory is one product and a scan; the same holds of the recurrence in L. Feng et al., "Were RNNs All We Needed?",
//! arXiv:2410.01201 (2024), whose minimal GRU this is with a network in place of its linear maps. At a first sample all have settled.

use candle_core::{Result, Tensor};
use candle_nn::{VarBuilder, ops::sigmoid};

use crate::{
    operations::{Backend, relaxation_op::relax},
    perceptron::{Perceptron, PerceptronConfig},
};

/// Greatest offset of a rate: the slowest number begins training at about 1/1000 of the way a sample.
const SLOWEST: f32 = 7.0;
/// Width of the network's hidden layer, in numbers of the memory.
const WIDER: usize = 2;

/// Offset subtracted from lambda of number `at` of `numbers`: each begins slower than the one before.
pub(crate) fn lambda_offset(at: usize, numbers: usize) -> f32 {
    SLOWEST * at as f32 / numbers as f32
}

/// The memory in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub(crate) struct RelaxingMemory {
    /// M.
    pub(crate) numbers: usize,
    /// h [n] -> [G; lambda], lambda as it is before numbers are told apart [2 M].
    pub(crate) field: Perceptron,
}

impl RelaxingMemory {
    /// A memory of `numbers`, led by h of `inputs`.
    pub(crate) fn new(numbers: usize, inputs: usize, skip: bool, vb: VarBuilder) -> Result<Self> {
        let field = PerceptronConfig {
            inputs,
            outputs: 2 * numbers,
            hidden: vec![WIDER * numbers],
            skip,
            relaxing: false,
        };
        Ok(Self {
            numbers,
            field: Perceptron::new(field, vb)?,
        })
    }

    /// h [rows, n] -> the share of the way to the target that a step goes, and the target, both [rows, M].
    fn share_and_target(&self, h: &Tensor) -> Result<(Tensor, Tensor)> {
        let found = self.field.forward(h)?;
        let offsets: Vec<f32> = (0..self.numbers)
            .map(|at| lambda_offset(at, self.numbers))
            .collect();
        let offsets = Tensor::new(offsets, h.device())?.to_dtype(h.dtype())?;
        let lambda = found.narrow(1, self.numbers, self.numbers)?;
        let share = sigmoid(&lambda.broadcast_sub(&offsets)?)?;
        Ok((share, found.narrow(1, 0, self.numbers)?.contiguous()?))
    }

    /// h [B T, n] -> m [B T, M] of B trajectories of T >= 2 samples.
    pub(crate) fn forward(&self, operations: Backend, h: &Tensor, batch: usize) -> Result<Tensor> {
        let (share, target) = self.share_and_target(h)?;
        let samples = h.dim(0)? / batch;
        let shape = (batch, samples, self.numbers);
        let (share, target) = (share.reshape(shape)?, target.reshape(shape)?);
        let begin = target.narrow(1, 0, 1)?.squeeze(1)?.contiguous()?;
        let later = |rows: Tensor| rows.narrow(1, 1, samples - 1)?.contiguous();
        let states = relax(operations, &begin, &later(share)?, &later(target)?)?;
        states.reshape((batch * samples, self.numbers))
    }

    /// m [1, M] at a first sample, or where the motion stays as it is: settled.
    pub(crate) fn settled(&self, h: &Tensor) -> Result<Tensor> {
        Ok(self.share_and_target(h)?.1)
    }

    /// m [1, M] one sample on.
    pub(crate) fn follow(&self, before: &Tensor, h: &Tensor) -> Result<Tensor> {
        let (share, target) = self.share_and_target(h)?;
        before + (share * (target - before)?)?
    }
}
