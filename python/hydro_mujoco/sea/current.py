"""Currents: constant, by depth, on a grid, random in time, and set by a program, the same as the plugin's.

Its own description: crates/effects/src/sea/current.rs and grid.rs.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from . import random

#: Axes of a grid, in the order in which a velocity's index rises.
AXES = ("x", "y", "depth", "time")
#: Numbers of memory of a random part: its velocity [m/s], and how many draws were made.
RANDOM = 4
#: Numbers of memory of what a program sets [m/s].
SET = 3


@dataclass(frozen=True)
class Current:
    """Velocity of the water by place, depth and time, in the world.

    Attributes:
        axes: ascending coordinates of x, y [m], depth [m] and time [s]; of one number where an axis has no influence.
        velocity: at the points of the axes [m/s], shape (time, depth, y, x, 3).
        deviation: of the random part [m/s], shape (3,); None without one.
        seed: of the random part.
        is_settable: whether a program may add to it while it runs.
    """

    axes: tuple[np.ndarray, ...]
    velocity: np.ndarray
    deviation: np.ndarray | None = None
    seed: int = 0
    is_settable: bool = False

    @property
    def memory(self) -> int:
        """Numbers of its memory in the plugin's state: of the random part, then what a program sets."""
        return (0 if self.deviation is None else RANDOM) + (SET if self.is_settable else 0)

    @classmethod
    def read(cls, document: Mapping[str, Any]) -> Self:
        """The current of a document `hydro-current/1` that the plugin has accepted."""
        grid = document.get("grid") or {"velocity": [document.get("velocity")]}
        if "profile" in document:
            points = document["profile"]
            grid = {key: [point[key] for point in points] for key in ("depth", "velocity")}
        axes = tuple(np.array(grid.get(axis, [0.0]), float) for axis in AXES)
        velocity = np.array(grid["velocity"], float).reshape(*(len(axis) for axis in reversed(axes)), 3)
        gusts = document.get("random") or {}
        deviation = np.array(gusts["deviation"], float) if gusts else None
        return cls(axes, velocity, deviation, gusts.get("seed", 0), document.get("settable", False))

    def mean(self, points: np.ndarray, time: float) -> np.ndarray:
        """Mean velocity [m/s] at points x, y, depth [m] of shape (p, 3) and a time [s]; shape (p, 3).

        Linear between the coordinates of each axis, constant outside them.
        """
        values = self.velocity
        places = [np.full(len(points), time), points[:, 2], points[:, 1], points[:, 0]]
        # Time first: the same for all points.
        corners = [_bracket(axis, place) for axis, place in zip(reversed(self.axes), places)]
        total = np.zeros((len(points), 3))
        for corner in np.ndindex(2, 2, 2, 2):
            index = tuple(before + (after if step else 0) for step, (before, after, _) in zip(corner, corners))
            weights = [share if step else 1 - share for step, (_, _, share) in zip(corner, corners)]
            total += np.prod(weights, axis=0)[:, None] * values[index]
        return total

    def remembered(self, memory: np.ndarray) -> np.ndarray:
        """Velocity of the random part and of what a program has set [m/s], shape (3,), from its memory."""
        total = np.zeros(3)
        if self.deviation is not None:
            is_started = memory[RANDOM - 1] != 0
            total += memory[:3] if is_started else self.deviation * random.normal(self.seed, random.CURRENT, 0)[:3]
        if self.is_settable:
            total += memory[-SET:]
        return total


def _bracket(axis: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Index of the coordinate before each place, 1 where there is one after it, and that one's share."""
    if len(axis) == 1:
        zero = np.zeros(len(place), int)
        return zero, zero, np.zeros(len(place))
    before = np.clip(np.searchsorted(axis, place, side="right") - 1, 0, len(axis) - 2)
    share = (place - axis[before]) / (axis[before + 1] - axis[before])
    return before, np.ones(len(place), int), np.clip(share, 0, 1)
