"""A perceptron with SiLU and a linear part beside it, on the device (crates/model/src/perceptron)."""

import numpy as np
import warp as wp

from .kernels.dense import affine
from .lanes import Lanes

Weights = dict[str, np.ndarray]


def on_device(numbers: np.ndarray, device: wp.Device) -> wp.array:
    """Numbers in single precision; on a GPU a matrix by columns, for neighbouring threads read neighbouring rows."""
    if numbers.ndim == 2 and device.is_cuda:
        return wp.array(np.ascontiguousarray(numbers.T), dtype=float, device=device).transpose()
    return wp.array(np.ascontiguousarray(numbers), dtype=float, device=device)


class Product:
    """y = W x + b + A x_0, with SiLU or not."""

    def __init__(
        self,
        weight: np.ndarray,
        bias: np.ndarray,
        device: wp.Device,
        *,
        linear: np.ndarray | None = None,
        is_activated: bool = False,
    ):
        self.rows, self.inputs = weight.shape
        self._weight, self._bias = on_device(weight, device), on_device(bias, device)
        self._linear = on_device(np.zeros((self.rows, 0)) if linear is None else linear, device)
        self._is_activated = is_activated
        self._device = device

    def launch(self, due: Lanes, x: wp.array, y: wp.array, first: wp.array | None = None) -> None:
        """Multiply where a world of a group is due.

        Args:
            x: shape (groups, inputs) or wider, of fours. first: x_0; x where it is not given. y: shape (groups, rows).
        """
        wp.launch(
            affine,
            dim=(y.shape[0], (self.rows + 1) // 2),
            inputs=[due.groups, self._weight, self._bias, x, self._linear, x if first is None else first]
            + [self._is_activated],
            outputs=[y],
            device=self._device,
        )


class Perceptron:
    """The layers `NAME.0`, `NAME.1`, .. and `NAME.skip` of a checkpoint.

    Attributes:
        inputs, outputs: their numbers.
    """

    def __init__(self, weights: Weights, name: str, groups: int, device: wp.Device, *, is_relaxing: bool = False):
        """is_relaxing: -1 is added to the leading diagonal of the linear part."""
        count = sum(key.startswith(f"{name}.") and key.endswith(".bias") for key in weights)
        linear = weights.get(f"{name}.skip.weight")
        if linear is not None and is_relaxing:
            linear = linear - np.eye(*linear.shape)
        self._layers = [
            Product(
                weights[f"{name}.{layer}.weight"],
                weights[f"{name}.{layer}.bias"],
                device,
                linear=linear if layer == count - 1 else None,
                is_activated=layer < count - 1,
            )
            for layer in range(count)
        ]
        self.inputs, self.outputs = self._layers[0].inputs, self._layers[-1].rows
        self._hidden = [Lanes(groups, layer.rows, device) for layer in self._layers[:-1]]

    def launch(self, due: Lanes, x: wp.array, y: wp.array) -> None:
        """y, shape (groups, outputs), of x, shape (groups, inputs) or wider, where a world of a group is due."""
        source = x
        for layer, hidden in zip(self._layers, [*self._hidden, None], strict=True):
            target = y if hidden is None else hidden.groups
            layer.launch(due, source, target, x)
            source = target
