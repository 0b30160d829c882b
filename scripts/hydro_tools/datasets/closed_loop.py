"""Closed-loop error: a scene driven by the controls of a recorded rollout, its base against the recorded one."""

import mujoco
import numpy as np

from . import replay

#: When the error is read [s].
INSTANTS = (1.0, 2.0, 4.0)


def attitude_error(a: np.ndarray, b: np.ndarray) -> float:
    """Angle between two attitudes (unit quaternions [4]), degrees."""
    difference = np.zeros(3)
    mujoco.mju_subQuat(difference, a, b)
    return float(np.degrees(np.linalg.norm(difference)))


def errors(model: mujoco.MjModel, run: dict[str, np.ndarray], sample_period: float) -> dict[float, tuple[float, float]]:
    """Position [m] and attitude [degrees] error at each of INSTANTS that the run reaches."""
    rows = {round(t / sample_period): t for t in INSTANTS if round(t / sample_period) < len(run["qpos"])}
    out = {}
    for k, data in enumerate(replay.replay(model, run, sample_period)):
        if k in rows:
            truth = run["qpos"][k]
            distance = float(np.linalg.norm(data.qpos[:3] - truth[:3]))
            out[rows[k]] = (distance, attitude_error(data.qpos[3:7], truth[3:7]))
    return out
