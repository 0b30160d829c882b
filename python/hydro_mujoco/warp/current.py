"""The current of an instance, from its attribute."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Current:
    """Velocity of the water in the world: the same everywhere, and by depth, and gusts [m/s].

    Attributes:
        uniform: shape (3,).
        depth: points of a profile [m], ascending, shape (n,), and its `velocity` there, shape (n, 3); none without one.
        deviation: standard deviations of the gusts, shape (3,). time_constant: of the gusts [s]. seed: of the gusts.
    """

    uniform: np.ndarray = field(default_factory=lambda: np.zeros(3))
    depth: np.ndarray = field(default_factory=lambda: np.zeros(0))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    deviation: np.ndarray = field(default_factory=lambda: np.zeros(3))
    time_constant: float = 1.0
    seed: int = 0

    @property
    def has_gusts(self) -> bool:
        """True where a part of it is random."""
        return bool(np.any(self.deviation))


def current(document: dict[str, Any]) -> Current:
    """The current of a `hydro-current/1` that the plugin has read and found right."""
    random = document.get("random") or {"deviation": [0, 0, 0], "time_constant": 1}
    points = document.get("profile") or [{"depth": 0, "velocity": document["velocity"]}]
    velocity = np.array([point["velocity"] for point in points], dtype=float)
    # One point is the same everywhere.
    is_uniform = len(points) == 1
    return Current(
        uniform=velocity[0] if is_uniform else np.zeros(3),
        depth=np.zeros(0) if is_uniform else np.array([float(point["depth"]) for point in points]),
        velocity=np.zeros((0, 3)) if is_uniform else velocity,
        deviation=np.array(random["deviation"], dtype=float),
        time_constant=float(random["time_constant"]),
        seed=int(random.get("seed", 0)),
    )
