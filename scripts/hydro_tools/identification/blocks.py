"""A bootstrap over leg configurations: intervals when tows of one posture err together.

Each replicate draws configurations with replacement, and the centre of its prior from the prior: so an interval
that the data do not narrow stays as wide as the prior. MuJoCo's force is a weighted sum of the coefficients' columns,
so a replicate is a bounded linear least-squares problem with the bounds of the toolbox's fit.
"""

import numpy as np
from scipy.optimize import lsq_linear

from hydro_mujoco.recording.randomness import generator

from .coefficients import DEFAULT, LARGEST, LARGEST_OFFSET
from .fit import Fit, Prior, Tank, level_factors, whitened

#: Random stream; replicates.
REPLICATES, COUNT = 303, 500


def _levels(design: np.ndarray, target: np.ndarray, drag: np.ndarray, lift: np.ndarray) -> np.ndarray:
    """Factors on drag and lift defaults [2] for a whitened design whose last two columns are the offsets."""
    columns = np.column_stack((design[:, :-2] @ drag, design[:, :-2] @ lift, design[:, -2:]))
    return lsq_linear(
        columns,
        target,
        ([0.01, 0.01, -LARGEST_OFFSET, -LARGEST_OFFSET], [LARGEST, LARGEST, LARGEST_OFFSET, LARGEST_OFFSET]),
    ).x[:2]


def bootstrap(tank: Tank, fit: Fit, prior: Prior, seed: int, count: int = COUNT) -> np.ndarray:
    """Acting coefficients and offsets of every replicate [count, k]."""
    rng, tows, acting = generator(seed, REPLICATES), tank.tows, tank.acting
    design = whitened(tank, fit.sd).reshape(len(tows), 2, -1)
    target = (tows.force - tank.rest) / fit.sd
    # The frozen coefficients exert no force.
    drag, lift = (
        (level_factors(*which) - level_factors(0.0, 0.0))[acting] * DEFAULT[acting] for which in ((1, 0), (0, 1))
    )
    blocks = [np.flatnonzero(tows.configuration == number) for number in np.unique(tows.configuration)]
    high = np.concatenate((np.full(acting.sum(), LARGEST), (LARGEST_OFFSET,) * 2))
    low = np.concatenate((np.zeros(acting.sum()), (-LARGEST_OFFSET,) * 2))
    out = np.empty((count, len(high)))
    for i in range(count):
        rows = np.concatenate([blocks[k] for k in rng.integers(len(blocks), size=len(blocks))])
        matrix, wanted = design[rows].reshape(-1, len(high)), target[rows].ravel()
        factor = _levels(matrix, wanted, drag, lift) if prior.levelled else np.ones(2)
        mean = drag * factor[0] + lift * factor[1]
        spread = np.concatenate((prior.relative * mean, fit.spread[-2:]))
        centre = np.concatenate((mean, (0.0, 0.0))) + spread * rng.normal(size=len(high))
        out[i] = lsq_linear(
            np.concatenate((matrix, np.diag(1.0 / spread))), np.concatenate((wanted, centre / spread)), (low, high)
        ).x
    return out
