"""The Relaxation-ODE in MuJoCo Warp (crates/model/src/architectures/relaxation_ode.rs)."""

import warp as wp

from .card import Card
from .kernels.relaxing import differences, lead, push, relax, settle
from .perceptron import Perceptron
from .sampling import Sampling


class Relaxation:
    """Modes that relax to targets at rates, both of the motion in a window and of a memory that relaxes likewise."""

    predicts_next = False

    def __init__(self, card: Card, sampling: Sampling):
        config, weights, device = card.config, card.weights, sampling.device
        self._s = s = sampling
        window, self._modes, memory = config.get("window", 2), config.get("modes", 1), config.get("memory", 0)
        self._window = wp.zeros((s.groups, window, s.inputs), dtype=wp.vec4, device=device)
        self._field = Perceptron(weights, "field", s.groups, device)
        self._found = s.lanes(self._field.outputs)
        self._h = s.lanes(self._field.inputs)
        self._slower = wp.zeros((s.groups, self._modes - 1, s.outputs), dtype=wp.vec4, device=device)
        self._memory = Perceptron(weights, "memory", s.groups, device) if memory else None
        self._led, self._remembered = s.lanes(2 * memory), s.lanes(memory)

    def observe(self) -> None:
        """Take the samples that are due."""
        s = self._s
        starts, due, device = s.starts.groups, s.due.groups, s.device
        shape = (s.groups, s.inputs)
        wp.launch(push, dim=shape, inputs=[starts, due, s.z.groups], outputs=[self._window], device=device)
        h = self._h.groups
        wp.launch(differences, dim=shape, inputs=[due, self._window], outputs=[h], device=device)
        if self._memory is not None:
            self._memory.launch(s.due, h, self._led.groups)
            remembered = self._remembered.groups
            behind = h[:, self._memory.inputs :]
            inputs = [starts, due, self._led.groups, remembered]
            wp.launch(lead, dim=remembered.shape, inputs=inputs, outputs=[behind], device=device)
        found, units = self._found.groups, [s.mean, s.std]
        self._field.launch(s.due, h, found)
        if not s.is_given:
            wp.launch(
                settle,
                dim=(s.groups, s.outputs),
                inputs=[starts, found, self._modes, *units],
                outputs=[s.first.groups],
                device=device,
            )
        wp.launch(
            relax,
            dim=(s.groups, s.outputs),
            inputs=[starts, due, found, *units, s.first.groups, self._slower],
            outputs=[s.now.groups],
            device=device,
        )
