"""Many simulations of one scene in `mujoco.batch`, or one after the other by `mj_step`."""

import hashlib
import time

import mujoco
import numpy as np
from mujoco.batch import Batch

from ..worker import serve
from . import scenes

#: Steps after which the states are compared bit by bit.
CHECKED = 100


def start(model: mujoco.MjModel, count: int) -> np.ndarray:
    """Random velocities of `count` simulations."""
    return 0.2 * np.random.default_rng(0).standard_normal((count, model.nv))


def digest(states) -> list[float]:
    """48 bits of the states' hash, as a number that a double holds."""
    content = np.ascontiguousarray(states, np.float64).tobytes()
    return [float(int.from_bytes(hashlib.sha256(content).digest()[:6], "big"))]


class Batched:
    """`simulations` at once on `threads` threads."""

    def __init__(self, *, simulations: int, threads: int, **scene):
        self.model = scenes.load(**scene)
        self.batch = Batch(self.model, simulations, threads)
        self.views = [self.batch.bind(name) for name in ("qpos", "qvel")]
        self.simulations = simulations

    def start(self) -> None:
        self.batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self.views[1][:] = start(self.model, self.simulations)

    def check(self):
        self.start()
        self.batch.step(nstep=CHECKED)
        return digest(np.concatenate([np.asarray(view).reshape(self.simulations, -1) for view in self.views], 1))

    def block(self, count: int) -> dict:
        self.start()
        self.batch.step(nstep=5)
        begin = time.perf_counter()
        self.batch.step(nstep=count)
        return {"seconds": time.perf_counter() - begin}


class Loop:
    """`mj_step` on one simulation after the other: what the batch must repeat to the bit."""

    def __init__(self, *, simulations: int, **scene):
        self.model = scenes.load(**scene)
        self.velocities = start(self.model, simulations)

    def check(self):
        states = []
        for velocity in self.velocities:
            data = mujoco.MjData(self.model)
            data.qvel[:] = velocity
            mujoco.mj_step(self.model, data, nstep=CHECKED)
            states.append(np.concatenate([data.qpos, data.qvel]))
        return digest(states)

    def block(self, count: int) -> dict:
        data = mujoco.MjData(self.model)
        data.qvel[:] = self.velocities[0]
        begin = time.perf_counter()
        mujoco.mj_step(self.model, data, nstep=count)
        return {"seconds": time.perf_counter() - begin}


if __name__ == "__main__":
    serve({"batched": Batched, "loop": Loop})
