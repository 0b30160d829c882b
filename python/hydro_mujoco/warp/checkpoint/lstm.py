"""The LSTM in MuJoCo Warp (crates/model/src/architectures/lstm.rs)."""

import numpy as np
import warp as wp

from .card import Card
from .kernels.recurrent import join, turn
from .kernels.stepping import to_si
from .perceptron import Product
from .sampling import Sampling


class Layer:
    """A layer: its product and its memory. h: its numbers, shape (groups, width)."""

    def __init__(self, weights: dict[str, np.ndarray], name: str, sampling: Sampling):
        self._s = s = sampling
        both = np.hstack([weights[f"{name}.input.weight"], weights[f"{name}.recurrent.weight"]])
        self._product = Product(both, weights[f"{name}.bias"], s.device)
        width = self._product.rows // 4
        self._input, self._gates = s.lanes(self._product.inputs), s.lanes(self._product.rows)
        self._h, self._c = s.lanes(width), s.lanes(width)
        self.h = self._h.groups

    def launch(self, x: wp.array) -> None:
        """Take the samples that are due; x: shape (groups, inputs)."""
        s = self._s
        masks, seen = [s.starts.groups, s.due.groups], self._input.groups
        wp.launch(join, dim=seen.shape, inputs=[*masks, x, self.h], outputs=[seen], device=s.device)
        self._product.launch(s.due, seen, self._gates.groups)
        inputs = [*masks, self._gates.groups]
        wp.launch(turn, dim=self.h.shape, inputs=inputs, outputs=[self._c.groups, self.h], device=s.device)


class Lstm:
    """Layers of long short-term memory; a linear layer gives the force."""

    predicts_next = False

    def __init__(self, card: Card, sampling: Sampling):
        self._s = s = sampling
        w = card.weights
        self._layers = [Layer(w, f"layer.{layer}", s) for layer in range(len(card.config["hidden"]))]
        linear = w.get("skip.weight")
        self._output = Product(w["output.weight"], w["output.bias"], s.device, linear=linear)
        self._found = s.lanes(s.outputs)

    def observe(self) -> None:
        """Take the samples that are due."""
        s = self._s
        x = s.z.groups
        for layer in self._layers:
            layer.launch(x)
            x = layer.h
        found = self._found.groups
        self._output.launch(s.due, x, found, s.z.groups)
        inputs = [s.due.groups, found, s.mean, s.std]
        wp.launch(to_si, dim=found.shape, inputs=inputs, outputs=[s.now.groups], device=s.device)
