"""The CNODE in MuJoCo Warp, along the causal path (crates/model/src/architectures/cnode.rs)."""

import warp as wp

from .card import Card
from .force_ode import TABLEAUX
from .kernels.controlled import begin_path, end_path, follow_path, remember_path, stage_of_path
from .kernels.stepping import to_si
from .perceptron import Perceptron, Product
from .sampling import Sampling


class Cnode:
    """A state, the force at its front, that follows the changes of the motion."""

    predicts_next = False

    def __init__(self, card: Card, sampling: Sampling):
        self._s = s = sampling
        w = card.weights
        self._is_euler, self._tableau = card.solver == "euler", TABLEAUX[card.solver]
        self._lift = Product(w["lift.weight"], w["lift.bias"], s.device)
        self._field = Perceptron(w, "field", s.groups, s.device)
        self._estimate = Perceptron(w, "estimate", s.groups, s.device)
        self._seen, self._lifted = s.lanes(self._lift.inputs), s.lanes(self._lift.rows)
        self._guess, self._found = s.lanes(s.outputs), s.lanes(self._field.outputs)
        self._state, self._slope, self._change, self._input = (s.lanes(self._field.inputs) for _ in range(4))
        self._older, self._newer = s.lanes(s.inputs), s.lanes(s.inputs)

    def observe(self) -> None:
        """Take the samples that are due."""
        s = self._s
        starts, due, z, units = s.starts.groups, s.due.groups, s.z.groups, [s.mean, s.std]
        first, seen = s.first.groups, self._seen.groups
        if not s.is_given:
            self._estimate.launch(s.starts, z, self._guess.groups)
            inputs = [starts, self._guess.groups, *units]
            wp.launch(to_si, dim=first.shape, inputs=inputs, outputs=[first], device=s.device)
        inputs = [starts, first, *units, s.least, s.most, z]
        wp.launch(begin_path, dim=seen.shape, inputs=inputs, outputs=[seen], device=s.device)
        self._lift.launch(s.starts, seen, self._lifted.groups)
        self._step()
        inputs = [starts, due, seen, self._lifted.groups, self._change.groups, s.outputs]
        state = self._state.groups
        wp.launch(end_path, dim=state.shape, inputs=inputs, outputs=[state], device=s.device)
        latest = [self._older.groups, self._newer.groups]
        wp.launch(remember_path, dim=z.shape, inputs=[starts, due, z], outputs=latest, device=s.device)
        wp.launch(
            to_si,
            dim=(s.groups, s.outputs),
            inputs=[due, state, *units],
            outputs=[s.now.groups],
            device=s.device,
        )

    def _step(self) -> None:
        """The change of the state from the sample before to the present one."""
        s = self._s
        due, state, field = s.due.groups, self._state.groups, self._input.groups
        moved = [self._slope.groups, self._change.groups]
        latest = [self._older.groups, self._newer.groups, s.z.groups]
        for number, (along, weight) in enumerate(self._tableau):
            wp.launch(
                stage_of_path,
                dim=state.shape,
                inputs=[due, state, along, number == 0],
                outputs=[*moved, field],
                device=s.device,
            )
            self._field.launch(s.due, field, self._found.groups)
            wp.launch(
                follow_path,
                dim=state.shape,
                inputs=[due, self._found.groups, *latest, self._is_euler, along, weight],
                outputs=moved,
                device=s.device,
            )
