"""Tows held out of a fit.

Held out at random: of every direction and speed the same share of conditions, so all of them occur on both sides;
repeats of a condition stay together. A held-out tow's leg configuration was seen, at other speeds and directions:
leaving out whole configurations is the harder question, and asked beside it.
"""

import numpy as np

from hydro_mujoco.recording.randomness import generator
from hydro_tools.datasets import DataError

from .measurements import Measurements

#: Random stream.
HOLD_OUT = 301


def held_out(tows: Measurements, share: float, seed: int) -> np.ndarray:
    """Mask [N] of the tows that are held out."""
    if not 0.0 < share < 1.0:
        raise DataError(f"held-out share {share:g}: expected more than 0 and less than 1")
    held = np.zeros(len(tows), bool)
    strata = sorted(set(zip(tows.direction.tolist(), tows.speed.tolist())))
    for number, (direction, speed) in enumerate(strata):
        rows = (tows.direction == direction) & (tows.speed == speed)
        conditions = np.unique(tows.condition[rows])
        count = min(max(round(share * len(conditions)), 1), len(conditions) - 1)
        chosen = generator(seed, HOLD_OUT, number).permutation(conditions)[:count]
        held |= np.isin(tows.condition, chosen)
    if not held.any():
        raise DataError("every direction and speed was towed in one leg configuration alone: nothing can be held out")
    return held
