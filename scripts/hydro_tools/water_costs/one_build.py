"""Microseconds a step with the library that HYDRO_PLUGIN names, as JSON.

python -m hydro_tools.water_costs.one_build BLOCKS
"""

import hashlib
import json
import sys

import mujoco
import numpy as np

from hydro_mujoco.plugin import load_plugin

from ..repository import ROOT
from .rows import AXES
from .scene import GEOMS, Water, effect, model
from .timing import step_time

#: Steps of a block, and those after which the motions of two builds are compared.
STEPS, COMPARED = 1000, 500


def swim(checkpoint: str) -> mujoco.MjModel:
    """The swimming B1 in a checkpoint's water."""
    text = (ROOT / "mjcf/b1_swim.xml").read_text()
    return mujoco.MjModel.from_xml_string(text.replace("models/b1-task2", str(ROOT / "models" / checkpoint)))


def scenes() -> dict[str, mujoco.MjModel]:
    """What is stepped: networks, and water without one."""
    drag = effect("quadratic_drag", dict(zip(AXES, (20, 30, 40, 1, 1, 1))))
    current = effect("current", {"x": 0.3, "y": 0.1, "z": 0.0})
    mass = effect("added_mass", dict(zip(AXES, (5, 10, 15, 0.1, 0.2, 0.3))))
    return {
        "b1-task2": swim("b1-task2"),
        "b1-relaxation": swim("b1-relaxation"),
        "quadratic drag in a current": model(GEOMS["box"], Water([drag, current])),
        "the same with added mass": model(GEOMS["box"], Water([drag, current, mass])),
    }


def heard(text: str) -> None:
    """End the process at a warning, but for one: the B1 starts beyond what its checkpoint has seen."""
    if "the force is a guess" not in text:
        sys.exit(text)


def end(of: mujoco.MjModel) -> str:
    """Digest of the state after some steps."""
    data = mujoco.MjData(of)
    data.qvel[:] = 0.1
    mujoco.mj_step(of, data, COMPARED)
    return hashlib.sha256(np.concatenate([data.qpos, data.qvel]).tobytes()).hexdigest()


def main() -> None:
    """Print the median of the blocks of every scene, and where its motion ends."""
    load_plugin()
    mujoco.set_mju_user_warning(heard)
    found = {}
    for name, of in scenes().items():
        times = [step_time(of, STEPS) for _ in range(int(sys.argv[1]))]
        found[name] = {"microseconds": float(np.median(times)), "end": end(of)}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
