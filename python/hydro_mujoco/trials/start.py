"""The state that a trial starts from, where the mapping says where it is in the log."""

import mujoco
import numpy as np

from ..errors import DataError
from . import frames
from .model import Model
from .resample import GAP, linear, slerp
from .signals import Signal, Signals

#: Samples of a state further apart than this say nothing of the time between them [s].
LONGEST = 0.5


def initial_state(model: Model, signals: Signals, start: float) -> np.ndarray | None:
    """Time 0, qpos, qvel and the rest of the full-physics state at log time `start`; None where it is not known.

    What is neither position nor velocity (activations, memory of plugins) is as a new simulation has it.
    """
    if not signals.state:
        return None
    data = mujoco.MjData(model.compiled)
    for key, parts in signals.state.items():
        found = {part: _at(signal, start) for part, signal in parts.items()}
        if not all(np.isfinite(value).all() for value in found.values()):
            return None
        if key in model.free:
            qpos, qvel = model.free[key]
            velocity = found["linear_velocity"]
            if parts["linear_velocity"].source.frame in frames.BODY:
                velocity = frames.matrices(found["attitude"][None])[0] @ velocity
            data.qpos[qpos : qpos + 7] = [*found["position"], *found["attitude"]]
            data.qvel[qvel : qvel + 6] = [*velocity, *found["angular_velocity"]]
        else:
            joint = model.joints[key]
            data.qpos[joint.qpos], data.qvel[joint.qvel] = found["position"][0], found["velocity"][0]
    mujoco.mj_forward(model.compiled, data)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.zeros(mujoco.mj_stateSize(model.compiled, kind))
    mujoco.mj_getState(model.compiled, data, state, kind)
    return state


def refuse_unmapped(model: Model, signals: Signals, name: str) -> None:
    """Refuse a start of a model with joints that a mapping cannot name."""
    if signals.state and len(model.free) + len(model.joints) < model.compiled.njnt:
        raise DataError(
            f"{name}, [state]: the model has joints that are ball joints or have no name, whose start cannot be "
            "mapped; leave [state] out and `hydro gap` estimates it"
        )


def _at(signal: Signal, time: float) -> np.ndarray:
    longest = max(GAP * signal.period, LONGEST)
    method = slerp if signal.is_attitude else linear
    return method(*signal.within(time - longest, time + longest), np.array([time]), longest)[0]
