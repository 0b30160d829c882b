"""Velocities from the world into a body, or back, by an attitude."""

import numpy as np

from .frames import matrices
from .mapping.schema import Turn
from .resample import GAP, slerp

#: Attitudes further apart than this turn nothing that lies between them [s].
LONGEST = 0.5


def turned(
    times: np.ndarray, velocity: np.ndarray, attitude_times: np.ndarray, attitude: np.ndarray, turn: Turn
) -> np.ndarray:
    """Velocities (n, 3) at `times` [s] in the frame that `turn` leads to; NaN where there is no attitude.

    attitude: unit quaternions w x y z (m, 4), world_from_body in the model's frames, at attitude_times [s].
    """
    if not attitude_times.size:
        return np.full(velocity.shape, np.nan)
    steps = np.diff(attitude_times)
    longest = max(GAP * float(np.median(steps)) if steps.size else 0.0, LONGEST)
    world_from_axes = matrices(slerp(attitude_times, attitude, times, longest)) @ np.array(turn.mount)
    form = "nji,nj->ni" if turn.into == "body" else "nij,nj->ni"
    return np.einsum(form, world_from_axes, velocity)
