"""The memoryless perceptron in MuJoCo Warp (crates/model/src/architectures/mlp.rs)."""

import warp as wp

from .card import Card
from .kernels.stepping import to_si
from .perceptron import Perceptron
from .sampling import Sampling


class Mlp:
    """A perceptron of the newest sample."""

    predicts_next = False

    def __init__(self, card: Card, sampling: Sampling):
        self._s = sampling
        self._layers = Perceptron(card.weights, "field", sampling.groups, sampling.device)
        self._found = sampling.lanes(sampling.outputs)

    def observe(self) -> None:
        """Take the samples that are due."""
        s, found = self._s, self._found.groups
        self._layers.launch(s.due, s.z.groups, found)
        inputs = [s.due.groups, found, s.mean, s.std]
        wp.launch(to_si, dim=found.shape, inputs=inputs, outputs=[s.now.groups], device=s.device)
