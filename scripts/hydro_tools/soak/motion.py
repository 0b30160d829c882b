"""How a run starts and is driven. The same seed gives the same run."""

import mujoco
import numpy as np

#: At rest, and in violent motion.
MOTIONS = ("rest", "violent")
#: Greatest first velocities in violent motion: linear [m/s], angular [rad/s], of joints [rad/s].
LINEAR, ANGULAR, JOINTS = 3.0, 10.0, 5.0


def start(model: mujoco.MjModel, data: mujoco.MjData, motion: str, seed: int, scale: float = 1.0) -> None:
    """Reset, and give the free body of the vehicle or robot its first velocities."""
    mujoco.mj_resetData(model, data)
    if motion == "violent":
        rng = np.random.default_rng(seed)
        data.qvel[:3] = scale * rng.uniform(-LINEAR, LINEAR, 3)
        data.qvel[3:6] = scale * rng.uniform(-ANGULAR, ANGULAR, 3)
        hinges = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)
        dofs = model.jnt_dofadr[hinges]
        data.qvel[dofs] = scale * rng.uniform(-JOINTS, JOINTS, dofs.size)


def drive(model: mujoco.MjModel, data: mujoco.MjData, rng: np.random.Generator) -> None:
    """New commands, anywhere within the limits of the actuators."""
    low, high = model.actuator_ctrlrange.T
    limited = model.actuator_ctrllimited.astype(bool)
    data.ctrl[:] = rng.uniform(np.where(limited, low, -1.0), np.where(limited, high, 1.0))
