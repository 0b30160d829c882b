"""Velocities from the world into a body, or back, by an attitude."""

import numpy as np

from .frames import matrices
from .mapping.schema import Turn
from .resample import GAP, slerp
from .signals import Signal

#: Attitudes further apart than this turn nothing that lies between them [s].
LONGEST = 0.5


def turned(times: np.ndarray, velocity: np.ndarray, attitude: Signal, turn: Turn) -> np.ndarray:
    """Velocities (n, 3) at `times` [s], increasing, in the frame that `turn` leads to; NaN where there is no attitude.

    attitude: unit quaternions w x y z, world_from_body in the model's frames.
    """
    longest = max(GAP * attitude.period if np.isfinite(attitude.period) else 0.0, LONGEST)
    quaternions = slerp(*attitude.within(times[0] - longest, times[-1] + longest), times, longest)
    world_from_axes = matrices(quaternions) @ np.array(turn.mount)
    form = "nji,nj->ni" if turn.into == "body" else "nij,nj->ni"
    return np.einsum(form, world_from_axes, velocity)
