"""Closed-loop error: states that the controls of a recorded rollout led to, against the recorded ones."""

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

#: When the error is read [s].
INSTANTS = (1.0, 2.0, 4.0)


def attitude_error(a: np.ndarray, b: np.ndarray) -> float:
    """Angle between two attitudes (unit quaternions [4]), degrees."""
    difference = np.zeros(3)
    mujoco.mju_subQuat(difference, a, b)
    return float(np.degrees(np.linalg.norm(difference)))


@dataclass(frozen=True)
class Error:
    """Distance of the base [m]; angle of its attitude, and root mean square over the joints [degrees]."""

    position: float
    attitude: float
    joints: float


def errors(states: Iterable[mujoco.MjData], run: dict[str, np.ndarray], sample_period: float) -> dict[float, Error]:
    """The error at each of INSTANTS that the run reaches; states: one a sample, the start included."""
    rows = {round(t / sample_period): t for t in INSTANTS if round(t / sample_period) < len(run["qpos"])}
    out = {}
    for k, data in enumerate(states):
        if k in rows:
            truth = run["qpos"][k]
            distance = float(np.linalg.norm(data.qpos[:3] - truth[:3]))
            joints = float(np.degrees(np.sqrt(np.mean((data.qpos[7:] - truth[7:]) ** 2))))
            out[rows[k]] = Error(distance, attitude_error(data.qpos[3:7], truth[3:7]), joints)
    return out
