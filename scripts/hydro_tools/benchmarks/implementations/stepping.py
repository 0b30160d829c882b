"""`mj_step` of one scene: all steps, the extra cost of steps that evaluate the network, the first step."""

import time

import mujoco
import numpy as np

from ..worker import serve
from . import scenes

#: Steps from a fresh start, 0.4 s: long enough to swim, short enough to stay near the recorded motions.
RUN = 200
#: Physics steps a sample.
SAMPLE = 5


class Stepping:
    """The scene from random velocities, again and again."""

    def __init__(self, *, single: bool = True, **scene):
        """single: also time every step by itself (`evaluation_us`)."""
        self.model = scenes.load(**scene)
        self.data = mujoco.MjData(self.model)
        self.starts, self.single = 0, single

    def start(self) -> float:
        """Start anew, up to the first sample; returns the time [us] of the first step, which finds a start force."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qvel[:] = 0.2 * np.random.default_rng(self.starts).standard_normal(self.model.nv)
        begin = time.perf_counter_ns()
        mujoco.mj_step(self.model, self.data)
        first = time.perf_counter_ns() - begin
        mujoco.mj_step(self.model, self.data, nstep=SAMPLE - 1)
        self.starts += 1
        return first / 1000

    def check(self):
        """The state after a run; a warning of MuJoCo's is an error here."""
        self.starts = 0
        self.start()
        mujoco.mj_step(self.model, self.data, nstep=RUN)
        warned = [mujoco.mjtWarning(i).name for i, w in enumerate(self.data.warning) if w.number]
        if warned or not np.isfinite(self.data.qpos).all():
            raise RuntimeError(f"the simulation fell over: {warned}")
        return self.data.qpos

    def block(self, count: int) -> dict:
        seconds, clock, first = 0.0, time.perf_counter, []
        for _ in range(count // RUN):
            first.append(self.start())
            begin = clock()
            mujoco.mj_step(self.model, self.data, nstep=RUN)
            seconds += clock() - begin
        return {"seconds": seconds, "first_us": float(np.median(first)), **(self.evaluation() if self.single else {})}

    def evaluation(self) -> dict:
        """One step in five reaches a sample and evaluates the network: its surplus, in microseconds."""
        self.start()
        quick, slow, clock = [], [], time.perf_counter_ns
        for step in range(RUN):
            begin = clock()
            mujoco.mj_step(self.model, self.data)
            (slow if step % SAMPLE == SAMPLE - 1 else quick).append(clock() - begin)
        return {"evaluation_us": float(np.median(slow) - np.median(quick)) / 1000}


if __name__ == "__main__":
    serve({"stepping": Stepping})
