"""The energy that a vehicle may have in water that only takes.

In a calm scene (no gravity, contacts, commands) the kinetic and potential energy at the start, with that of the water
that moves along (added mass) and of the springs, is the most there can be. An integrator adds some of its own: the same
start without water, stepped as often, says how much.
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from .catalogue import Effect

#: Effects that take energy, or store what they give back, in still water. Not `basset_history`: it starts as if the
#: first velocity had been forever, and the boundary layer of that has energy of its own.
TAKING = frozenset(
    {
        "added_mass",
        "cross_flow_drag",
        "joint_damping",
        "joint_friction",
        "joint_stiffness",
        "linear_drag",
        "quadratic_drag",
        "wake_memory",
    }
)
#: Part by which the energy may exceed the bound.
TOLERANCE = 0.01
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def only_takes(effects: Sequence[Effect]) -> bool:
    """True where every effect is one of TAKING."""
    return all(effect.effect in TAKING for effect in effects)


def of(data: mujoco.MjData) -> float:
    """Kinetic and potential energy of the model's own [J]; of the last evaluation."""
    return float(data.energy.sum())


def stored(effects: Sequence[Effect], model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Energy at the present state of added mass and of springs [J]."""
    total = 0.0
    for effect in effects:
        if effect.effect == "added_mass":
            # The hull's frame stands in its middle; MuJoCo's linear velocity is the world's, and the start is upright.
            masses = np.array([effect.parameters[axis] for axis in AXES])
            total += 0.5 * float(masses @ data.qvel[:6] ** 2)
        elif effect.effect == "joint_stiffness":
            joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, effect.target)
            away = data.qpos[model.jnt_qposadr[joint]] - effect.parameters["reference"]
            total += 0.5 * effect.parameters["stiffness"] * float(away**2)
    return total
