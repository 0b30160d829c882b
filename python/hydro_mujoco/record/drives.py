"""The actuators of a robot: which of them are driven, and how far."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ..recording.features import Joint

#: Half-range of a position servo without limits: of a hinge [rad], of a slide [m].
FREE_HINGE, FREE_SLIDE = 0.7, 0.05
#: A servo moves so far from its middle at most [rad]; a slide as far as it can.
FURTHEST = 1.5

#: MuJoCo's codes: its enums and NumPy's integers compare in one order only.
ON_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
ON_SITE = (int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK))
ON_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
FIXED_GAIN, AFFINE_BIAS = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_AFFINE)
INTEGRATOR = int(mujoco.mjtDyn.mjDYN_INTEGRATOR)


@dataclass(frozen=True)
class Drive:
    """An actuator that is driven between `low` and `high` [control].

    rest: the command of the model's own posture. joint: for a position servo on a hinge or slide, its place in the list
    of features, and `gear`, commands a joint position.
    """

    actuator: int
    low: float
    high: float
    rest: float
    is_servo: bool
    joint: int | None = None
    gear: float = 1.0


def find(model: mujoco.MjModel, joints: Sequence[Joint], tree: list[int]) -> tuple[list[Drive], list[str]]:
    """The drives of the bodies `tree`, and the names of the actuators whose range is a guess."""
    numbers = {model.joint(joint.name).id: place for place, joint in enumerate(joints)}
    drives, guessed = [], []
    for actuator in range(model.nu):
        if not _moves(model, actuator, tree):
            continue
        servo = _is_servo(model, actuator)
        on_joint = int(model.actuator_trntype[actuator]) in ON_JOINT
        place = numbers.get(int(model.actuator_trnid[actuator, 0])) if on_joint else None
        gear = float(model.actuator_gear[actuator, 0])
        if model.actuator_ctrllimited[actuator]:
            low, high = (float(limit) for limit in model.actuator_ctrlrange[actuator])
        elif servo and place is not None:
            low, high = _joint_range(model, joints[place], gear)
        else:
            low, high = _effort_range(model, actuator)
            if not np.isfinite(high):
                low, high = -1.0, 1.0
                guessed.append(model.actuator(actuator).name or f"actuator {actuator}")
        if not low < high:
            continue
        rest = 0.0
        if servo and place is not None:
            rest = gear * float(model.qpos0[joints[place].position])
        drive = Drive(actuator, low, high, float(np.clip(rest, low, high)), servo)
        if servo and place is not None and gear:
            drive = Drive(actuator, low, high, drive.rest, True, place, gear)
        drives.append(drive)
    return drives, guessed


def _moves(model: mujoco.MjModel, actuator: int, tree: list[int]) -> bool:
    """True where the actuator acts on a body of the tree by a joint, site or tendon; adhesion stays off."""
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    if kind in ON_JOINT:
        return int(model.jnt_bodyid[target]) in tree
    if kind in ON_SITE:
        return int(model.site_bodyid[target]) in tree
    return kind == ON_TENDON


def _is_servo(model: mujoco.MjModel, actuator: int) -> bool:
    """True of a position servo: its force falls with its own length."""
    affine = int(model.actuator_biastype[actuator]) == AFFINE_BIAS
    integrates = int(model.actuator_dyntype[actuator]) == INTEGRATOR
    return bool(affine and model.actuator_biasprm[actuator, 1] < 0 and not integrates)


def _joint_range(model: mujoco.MjModel, joint: Joint, gear: float) -> tuple[float, float]:
    """Commands of a servo without limits: the range of its joint, else a little to either side."""
    number = model.joint(joint.name).id
    if model.jnt_limited[number]:
        ends = model.jnt_range[number]
    else:
        half = FREE_SLIDE if joint.is_slide else FREE_HINGE
        ends = model.qpos0[joint.position] + np.array([-half, half])
    low, high = sorted(float(end) * gear for end in ends)
    return low, high


def _effort_range(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Commands of a motor without limits, where those of its force say them; else infinite."""
    gain = abs(float(model.actuator_gainprm[actuator, 0]))
    if int(model.actuator_gaintype[actuator]) != FIXED_GAIN or gain == 0:
        return -np.inf, np.inf
    if model.actuator_forcelimited[actuator]:
        low, high = (float(limit) / gain for limit in model.actuator_forcerange[actuator])
        return low, high
    joint, gear = int(model.actuator_trnid[actuator, 0]), abs(float(model.actuator_gear[actuator, 0]))
    if int(model.actuator_trntype[actuator]) in ON_JOINT and model.jnt_actfrclimited[joint] and gear:
        low, high = (float(limit) / gain / gear for limit in model.jnt_actfrcrange[joint])
        return low, high
    return -np.inf, np.inf
