//! Sizes of a perceptron.

/// Sizes of a perceptron.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PerceptronConfig {
    /// Length of the input x.
    pub(crate) inputs: usize,
    /// Length of the output y.
    pub(crate) outputs: usize,
    /// Widths of the hidden layers.
    pub(crate) hidden: Vec<usize>,
    /// True if there is a linear part A.
    pub(crate) skip: bool,
    /// True if -1 is added to the leading diagonal of A. With the force first in x, dF/dt = -F + .. then holds before
    /// training, a stable relaxation within one sample, and training learns the departures from it.
    pub(crate) relaxing: bool,
}

impl Default for PerceptronConfig {
    /// The paper's: a force of 6 and a latent of 6 through three layers of 512.
    fn default() -> Self {
        Self {
            inputs: 12,
            outputs: 6,
            hidden: vec![512; 3],
            skip: false,
            relaxing: false,
        }
    }
}

impl PerceptronConfig {
    /// (inputs, outputs) of every layer.
    pub(crate) fn layers(&self) -> Vec<(usize, usize)> {
        let widths: Vec<usize> = [self.inputs]
            .iter()
            .chain(&self.hidden)
            .chain([&self.outputs])
            .copied()
            .collect();
        widths.windows(2).map(|pair| (pair[0], pair[1])).collect()
    }

    /// Numbers in all weights together.
    pub(crate) fn count(&self) -> usize {
        let layers: usize = self
            .layers()
            .iter()
            .map(|(inputs, outputs)| (inputs + 1) * outputs)
            .sum();
        layers
            + if self.skip {
                self.inputs * self.outputs
            } else {
                0
            }
    }
}
