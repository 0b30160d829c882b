"""Samples of sensors, actuators, joints and states, in the model's units and frames."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .mapping.schema import Source
from .scratch import blocks, some, steps
from .units import ATTITUDE


@dataclass(frozen=True)
class Signal:
    """Samples of a sensor, actuator, joint or state. The arrays are on disk: a part of them is read at a time.

    times: [s] of the log, increasing, (n,); values: (n, dim), NaN where the log has none.
    """

    name: str
    times: np.ndarray
    values: np.ndarray
    source: Source

    @cached_property
    def period(self) -> float:
        """Median time between samples [s]; of fewer than two, infinite."""
        return float(np.median(steps(self.times))) if self.times.size > 1 else np.inf

    @property
    def is_attitude(self) -> bool:
        """True for quaternions."""
        return self.source.quantity == ATTITUDE

    @cached_property
    def range(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest value of each component, (dim,) each; NaN of one that has none."""
        found = [self.values[block] for block in blocks(len(self.values))]
        return (
            np.fmin.reduce([np.fmin.reduce(values) for values in found]),
            np.fmax.reduce([np.fmax.reduce(values) for values in found]),
        )

    def some(self) -> np.ndarray:
        """Values (m, dim): all, or of a long signal some of them, drawn at random."""
        return self.values[some(len(self.values))]

    def within(self, start: float, stop: float) -> tuple[np.ndarray, np.ndarray]:
        """Times and values from `start` to `stop` [s], and the sample on either side of these."""
        first = max(int(np.searchsorted(self.times, start)) - 1, 0)
        last = int(np.searchsorted(self.times, stop, side="right")) + 1
        return self.times[first:last], self.values[first:last]


@dataclass(frozen=True)
class Signals:
    """All signals of a log, by name. state: body or joint -> part -> signal; mode: of the topic that splits."""

    sensors: dict[str, Signal]
    actuators: dict[str, Signal]
    joints: dict[str, Signal]
    state: dict[str, dict[str, Signal]]
    mode: Signal | None
