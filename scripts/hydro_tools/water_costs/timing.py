"""Microseconds a step, block by block in turn."""

import time

import mujoco
import numpy as np

from .rows import Row

#: Processor time of a block [s], and the steps of the shortest one.
BLOCK, FEWEST = 0.006, 100


def step_time(model: mujoco.MjModel, steps: int) -> float:
    """Microseconds of a step: the thread's own time, which other programs do not lengthen by waiting."""
    data = mujoco.MjData(model)
    data.qvel[:] = 0.1
    mujoco.mj_step(model, data, 100)
    start = time.thread_time_ns()
    mujoco.mj_step(model, data, steps)
    return (time.thread_time_ns() - start) / 1000 / steps


def measure(rows: list[Row], rounds: int) -> dict[str, np.ndarray]:
    """By row and round: microseconds a step without the plugin, without what is timed, with it [rounds, 3]."""
    models = {row.name: row.models() for row in rows}
    counts = {
        name: max(FEWEST, int(1e6 * BLOCK / min(step_time(each, FEWEST) for _ in range(2))))
        for name, three in models.items()
        for each in three[-1:]
    }
    times = {name: [] for name in models}
    for _ in range(rounds):
        for name, three in models.items():
            times[name].append([step_time(each, counts[name]) for each in three])
    return {name: np.array(each) for name, each in times.items()}


def table(times: dict[str, np.ndarray]) -> str:
    """Medians; differences are taken round by round."""
    lines = ["| water | us a step | adds to the scene without the plugin | alone |", "|---|---|---|---|"]
    for name, each in times.items():
        bare, without, wet = each.T
        low, high = np.quantile(wet - without, [0.25, 0.75])
        adds, alone = np.median(wet - bare), np.median(wet - without)
        lines.append(f"| {name} | {np.median(wet):.2f} | {adds:.2f} | {alone:.2f} ({low:.2f} to {high:.2f}) |")
    return "\n".join(lines)
