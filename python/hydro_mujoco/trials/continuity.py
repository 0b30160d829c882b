"""Attitudes and angles that go on from block to block."""

import numpy as np

from .frames import make_continuous
from .units import ANGLE, ATTITUDE


class Continuity:
    """Keeps where a signal was. jumps: by a turn that were taken out of its angles."""

    def __init__(self, quantity: str | None):
        self.jumps = 0
        self._continue = {ATTITUDE: self._attitude, ANGLE: self._angle}.get(quantity or "")
        self._last: np.ndarray | None = None

    def go_on(self, values: np.ndarray) -> None:
        """Put a block (n, dim) behind those before it, in place."""
        finite = np.isfinite(values).all(1)
        if self._continue and finite.any():
            self._continue(values, finite)

    def _attitude(self, values: np.ndarray, finite: np.ndarray) -> None:
        """Each quaternion on the side of the one before it."""
        make_continuous(values)
        first, last = values[finite][[0, -1]]
        if self._last is not None and first @ self._last < 0:
            values *= -1
            last = -last
        self._last = last

    def _angle(self, values: np.ndarray, finite: np.ndarray) -> None:
        """No jump by a turn."""
        logged = values[finite, 0]
        # The angle before, as it was logged and as it became.
        before = logged[:1].repeat(2) if self._last is None else self._last
        unwrapped = np.unwrap(np.concatenate([before[1:], logged]))[1:]
        turns = np.diff(unwrapped - logged, prepend=before[1] - before[0])
        self.jumps += int((np.abs(turns) > 1).sum())
        self._last = np.array([logged[-1], unwrapped[-1]])
        values[finite, 0] = unwrapped
