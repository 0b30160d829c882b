"""Gaits swum again: in another water than the one they were learnt in, and for longer."""

import math
from dataclasses import asdict

import numpy as np

from hydro_mujoco.envs.b1_tasks import TRIM

from ..datasets import scene
from . import episode
from .gait_file import Gait
from .generator import PERIOD
from .waters import Water

#: Seed of the starts of a replay: none that learning draws.
SEED = (35, 12)


def replay(gait: Gait, water: Water, *, seconds: float, starts: int, threads: int) -> episode.Track:
    """The gait from some starts in a water, which is as deep as it goes."""
    begin = episode.starts(water.model(), np.random.default_rng(SEED), starts)
    values = np.tile(gait.values, (starts, 1))
    return episode.swim(water.robots(starts, threads), values, begin, seconds, math.inf)


def summary(track: episode.Track) -> dict[str, float | None]:
    """Means over the starts of `episode.Judgement`; `swam` is the least, `cost` None where one does not go ahead."""
    each = [asdict(one) for one in episode.judge(track)]
    found: dict[str, float | None] = {}
    for name in each[0]:
        values = [one[name] for one in each]
        if name == "swam":
            found[name] = min(values)
        else:
            found[name] = None if None in values else float(np.mean(values))
    return found


def as_run(gait: Gait, water: Water, seconds: float) -> dict:
    """The gait's way from the first start, as `datasets.replay` replays one in the scene of that water.

    Start, commands and the foam's lift, a row each `scene.SAMPLE_PERIOD`.
    """
    begin = episode.starts(water.model(), np.random.default_rng(SEED), 1)
    track = episode.swim(water.robots(1, 1), gait.values[None], begin, seconds, math.inf)
    ctrl = np.repeat(track.ctrl[:, 0], round(PERIOD / scene.SAMPLE_PERIOD), axis=0)
    push = np.tile([0.0, 0.0, TRIM, 0.0, 0.0, 0.0], (len(ctrl), 1))
    return {"qpos": begin.qpos, "qvel": begin.qvel, "ctrl": ctrl, "push": push, "density": 1000.0}
