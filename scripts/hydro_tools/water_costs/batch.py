"""64 boats at once."""

import time

import mujoco
import numpy as np
from mujoco.batch import Batch

from .rows import BOAT, sea
from .scene import GEOMS, Water, model


def boats(rounds: int) -> str:
    """64 boats on one thread and on two: seconds, and whether the bits are the same."""
    water = Water(BOAT, sea(components=[{"height": 0.2, "period": 6}]))
    scene = model(GEOMS["box"], water)
    times, found = {1: [], 2: []}, {}
    batches = {threads: Batch(scene, 64, threads) for threads in times}
    for _ in range(rounds):
        for threads, batch in batches.items():
            batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
            batch.bind("qpos")[:, 2] += np.linspace(-0.1, 0.1, 64)
            start = time.perf_counter()
            batch.step(nstep=200)
            times[threads].append(time.perf_counter() - start)
            found[threads] = np.array(batch.bind("qpos"))
    one, two = (np.median(times[threads]) for threads in (1, 2))
    same = "the same bits" if np.array_equal(found[1], found[2]) else "OTHER BITS"
    return f"64 boats, 200 steps: {one:.3f} s on one thread, {two:.3f} s on two ({one / two:.2f} times as fast), {same}"
