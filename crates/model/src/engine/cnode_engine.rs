//! Engine of the CNODE, along the causal path. Memory: the two latest samples, the older first, and the state.

use pulp::Arch;

use super::{
    interface::{Engine, Scratch},
    packed_perceptron::{PackedPerceptron, Precision},
    units::Units,
};
use crate::{
    architectures::{
        cnode::{Cnode, STATE_LIMIT, stages},
        control_path::{CLOCK, causal},
    },
    force_model::ForceModel,
    kernel::{Panels, multiply_row},
    solver::{Solver, Tableau},
};

/// The engine; see the module.
#[derive(Clone, Debug)]
pub(super) struct CnodeEngine {
    arch: Arch,
    units: Units,
    solver: Solver,
    tableau: Tableau,
    /// W_g^T and b_g, in f32: they are read once a run.
    lift: (Panels<f32>, Vec<f32>),
    /// s [f + g] -> [f + g, n + 1].
    field: PackedPerceptron,
    /// z_0 [n] -> F_0 [f], in f32.
    estimate: PackedPerceptron,
    outputs: usize,
}

impl CnodeEngine {
    pub(super) fn new(
        model: &ForceModel,
        cnode: &Cnode,
        precision: Precision,
        arch: Arch,
    ) -> candle_core::Result<Self> {
        let (rows, columns) = cnode.lift.0.dims2()?;
        let lift = cnode.lift.0.flatten_all()?.to_vec1::<f32>()?;
        Ok(Self {
            arch,
            units: Units::from_model(model),
            solver: model.solver,
            tableau: stages(model.solver)?,
            lift: (
                Panels::transposed(&lift, columns, rows),
                cnode.lift.1.to_vec1::<f32>()?,
            ),
            field: PackedPerceptron::new(&cnode.field, precision)?,
            estimate: PackedPerceptron::new(&cnode.estimate, Precision::Single)?,
            outputs: model.outputs(),
        })
    }

    /// s.
    fn state(&self) -> usize {
        self.field.config.inputs
    }
}

impl Engine for CnodeEngine {
    fn inputs(&self) -> usize {
        self.units.features()
    }

    fn outputs(&self) -> usize {
        self.outputs
    }

    fn memory_len(&self) -> usize {
        2 * self.units.encoded() + self.state()
    }

    fn start(&self, x: &[f64], force: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let n = self.units.encoded();
        let lifted = self.lift.1.len();
        let (seen, rest) = scratch
            .take(self.outputs + n + lifted)
            .split_at_mut(self.outputs + n);
        let (standard, z) = seen.split_at_mut(self.outputs);
        self.units.standardise(force, standard);
        self.units.encode(x, z);
        rest.copy_from_slice(&self.lift.1);
        multiply_row(self.arch, rest, seen, &self.lift.0);
        let (older, others) = memory.split_at_mut(n);
        let (newer, state) = others.split_at_mut(n);
        for ((older, newer), z) in older.iter_mut().zip(newer).zip(&seen[self.outputs..]) {
            *older = f64::from(*z);
            *newer = *older;
        }
        for (slot, value) in state
            .iter_mut()
            .zip(seen[..self.outputs].iter().chain(&*rest))
        {
            *slot = f64::from(*value);
        }
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let (n, width) = (self.units.encoded(), self.state());
        let matrix = self.field.config.outputs;
        let scratch = scratch.take(n + 3 * width + matrix + n + 1 + self.field.scratch());
        let (z, rest) = scratch.split_at_mut(n);
        let (input, rest) = rest.split_at_mut(width);
        let (slope, rest) = rest.split_at_mut(width);
        let (change, rest) = rest.split_at_mut(width);
        let (found, rest) = rest.split_at_mut(matrix);
        let (control, layers) = rest.split_at_mut(n + 1);
        self.units.encode(x, z);
        let (older, others) = memory.split_at_mut(n);
        let (newer, state) = others.split_at_mut(n);
        let tableau = self.tableau;
        slope.fill(0.0);
        change.fill(0.0);
        control[n] = CLOCK as f32;
        for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
            for (i, slot) in control[..n].iter_mut().enumerate() {
                let x = [older[i], newer[i], f64::from(z[i])];
                *slot = causal(self.solver, x, *along) as f32;
            }
            for ((slot, state), slope) in input.iter_mut().zip(&*state).zip(&*slope) {
                *slot = *state as f32 + *along as f32 * slope;
            }
            self.field.evaluate(self.arch, input, found, layers);
            for (slope, row) in slope.iter_mut().zip(found.chunks_exact(n + 1)) {
                *slope = row.iter().zip(&*control).map(|(a, b)| a * b).sum();
            }
            for (change, slope) in change.iter_mut().zip(&*slope) {
                *change += *weight as f32 * slope;
            }
        }
        for (state, change) in state.iter_mut().zip(&*change) {
            *state = f64::from(*state as f32 + *change).clamp(-STATE_LIMIT, STATE_LIMIT);
        }
        for ((older, newer), z) in older.iter_mut().zip(newer).zip(&*z) {
            *older = *newer;
            *newer = f64::from(*z);
        }
    }

    fn sample(
        &self,
        memory: &[f64],
        _: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        _: &mut Scratch,
    ) {
        let force = &memory[2 * self.units.encoded()..];
        self.units
            .to_si(force.iter().map(|force| *force as f32), now);
        next.copy_from_slice(now);
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let n = self.units.encoded();
        let scratch = scratch.take(n + self.outputs + self.estimate.scratch());
        let (z, rest) = scratch.split_at_mut(n);
        let (found, layers) = rest.split_at_mut(self.outputs);
        self.units.encode(x, z);
        self.estimate.evaluate(self.arch, z, found, layers);
        self.units.to_si(found.iter().copied(), force);
    }
}
