"""What a network is given at a sample, and what it gives."""

from typing import Protocol

import numpy as np
import warp as wp

from .card import Card
from .lanes import Lanes, groups_of


class Sampling:
    """Samples and forces of all worlds.

    Attributes:
        starts: 1 where the sample is the first of a run, width 1. due: 1 where there is one, width 1.
        z: encoded and standardised.
        now, next: forces at the sample and one later [N, N m]. first: the force at a start.
        is_given: True where `first` is that of the attribute `initial_force`, False where the network estimates it.
        may_branch: False on a GPU whose driver has no loops in graphs.
        mean, std: of forces [N, N m]. least, most: range of forces [N, N m].
    """

    def __init__(self, card: Card, nworld: int, initial: np.ndarray | None, device: wp.Device):
        self.groups, self.device = groups_of(nworld), device
        self.inputs, self.outputs = len(card.input_mean), len(card.outputs)
        self.starts, self.due = self.lanes(1), self.lanes(1)
        self.z = self.lanes(self.inputs)
        self.now, self.next, self.first = (self.lanes(self.outputs) for _ in range(3))
        self.may_branch = True
        self.is_given = initial is not None
        if initial is not None:
            values = np.broadcast_to(initial[np.newaxis, :, np.newaxis], self.first.numbers.shape)
            self.first.numbers.assign(np.ascontiguousarray(values, dtype=np.float32))
        self.mean = wp.array(card.output_mean, dtype=float, device=device)
        self.std = wp.array(card.output_std, dtype=float, device=device)
        self.least = wp.array(card.forces[0], dtype=float, device=device)
        self.most = wp.array(card.forces[1], dtype=float, device=device)

    def lanes(self, width: int) -> Lanes:
        """Numbers of these worlds, all 0."""
        return Lanes(self.groups, width, self.device)


class Network(Protocol):
    """A network with its memory of earlier samples.

    Attributes:
        predicts_next: True where it gives the force one sample later too, False where the force is held till then.
    """

    predicts_next: bool

    def observe(self) -> None:
        """Take the samples that are due: `z` of the sampling into `now` and `next`."""
