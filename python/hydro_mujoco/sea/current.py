"""Currents: constant, by depth, on a grid, and random in time, the same as the plugin's.

Its own description: crates/effects/src/sea/current.rs and grid.rs.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from . import random

#: Axes of a grid, in the order in which a velocity's index rises.
AXES = ("x", "y", "depth", "time")
#: Numbers of memory of a random current: its velocity [m/s], and how many draws were made.
MEMORY = 4


@dataclass(frozen=True)
class Current:
    """Velocity of the water by place, depth and time, in the world.

    Attributes:
        axes: ascending coordinates of x, y [m], depth [m] and time [s]; of one number where an axis has no influence.
        velocity: at the points of the axes [m/s], shape (time, depth, y, x, 3).
        deviation: of the random part [m/s], shape (3,); None without one.
        seed: of the random part.
    """

    axes: tuple[np.ndarray, ...]
    velocity: np.ndarray
    deviation: np.ndarray | None = None
    seed: int = 0

    @classmethod
    def read(cls, document: Mapping[str, Any]) -> Self:
        """The current of a document `hydro-current/1` that the plugin has accepted."""
        grid = document.get("grid") or {"velocity": [document.get("velocity")]}
        if "profile" in document:
            points = document["profile"]
            grid = {key: [point[key] for point in points] for key in ("depth", "velocity")}
        axes = tuple(np.array(grid.get(axis, [0.0]), float) for axis in AXES)
        velocity = np.array(grid["velocity"], float).reshape(*(len(axis) for axis in reversed(axes)), 3)
        gusts = document.get("random")
        if gusts is None:
            return cls(axes, velocity)
        return cls(axes, velocity, np.array(gusts["deviation"], float), gusts.get("seed", 0))

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

    def gust(self, memory: np.ndarray) -> np.ndarray:
        """Velocity of the random part [m/s], shape (3,), of its memory in the plugin's state, shape (4,)."""
        if self.deviation is None:
            return np.zeros(3)
        if memory[3] == 0:
            return self.deviation * random.normal(self.seed, random.CURRENT, 0)[:3]
        return memory[:3].copy()


def _bracket(axis: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Index of the coordinate before each place, 1 where there is one after it, and that one's share."""
    if len(axis) == 1:
        zero = np.zeros(len(place), int)
        return zero, zero, np.zeros(len(place))
    before = np.clip(np.searchsorted(axis, place, side="right") - 1, 0, len(axis) - 2)
    share = (place - axis[before]) / (axis[before + 1] - axis[before])
    return before, np.ones(len(place), int), np.clip(share, 0, 1)
