//! The weights of a perceptron packed for matrix products, without Candle.

use super::sizes::PerceptronConfig;
use crate::kernel::{Panels, Real};

/// The same weights packed for products, without Candle.
#[derive(Clone, Debug)]
pub(crate) struct PackedLayers<T> {
    /// Per layer W^T and bias.
    pub(crate) layers: Vec<(Panels<T>, Vec<T>)>,
    /// A^T.
    pub(crate) skip: Option<Panels<T>>,
}

impl<T: Real> PackedLayers<T> {
    /// From the vector of [`Perceptron::flat`].
    pub(crate) fn new(config: &PerceptronConfig, flat: &[T]) -> Self {
        let mut rest = flat;
        let mut take = |count: usize| {
            let (head, tail) = rest.split_at(count);
            rest = tail;
            head
        };
        let layers = config
            .layers()
            .into_iter()
            .map(|(inputs, outputs)| {
                let weight = Panels::transposed(take(inputs * outputs), inputs, outputs);
                (weight, take(outputs).to_vec())
            })
            .collect();
        let skip = config.skip.then(|| {
            Panels::transposed(
                take(config.inputs * config.outputs),
                config.inputs,
                config.outputs,
            )
        });
        Self { layers, skip }
    }
}
