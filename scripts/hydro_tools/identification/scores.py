"""Errors of predicted forces, with the spread that the choice of leg configurations gives them."""

import numpy as np

from hydro_mujoco.recording.randomness import generator

from .measurements import Measurements

#: Random stream; how often configurations are drawn again.
RESAMPLING, RESAMPLES = 302, 1000
AXES = ("x", "y")


def _errors(gap: np.ndarray, force: np.ndarray, spread: np.ndarray) -> list[float]:
    """RMSE of x, y, both [N]; the same over the spread of the force; mean relative error."""
    square = (gap**2).mean(axis=0)
    rmse = [*np.sqrt(square), np.sqrt(square.mean())]
    whole = [*spread, np.sqrt((spread**2).mean())]
    relative = (np.linalg.norm(gap, axis=1) / np.linalg.norm(force, axis=1)).mean()
    return [*rmse, *(error / by for error, by in zip(rmse, whole)), relative]


def scores(tows: Measurements, predicted: np.ndarray, spread: np.ndarray, seed: int) -> dict:
    """rmse [N] and nrmse by axis and pooled, relative; each {value, ci95}.

    spread: standard deviation [2] N of the measured forces of the whole campaign, what nrmse is divided by;
    relative: the length of the force's error over the length of the force, mean over tows.
    """
    gap = predicted - tows.force
    blocks = [np.flatnonzero(tows.configuration == number) for number in np.unique(tows.configuration)]
    rng = generator(seed, RESAMPLING)
    drawn = []
    for _ in range(RESAMPLES):
        rows = np.concatenate([blocks[i] for i in rng.integers(len(blocks), size=len(blocks))])
        drawn.append(_errors(gap[rows], tows.force[rows], spread))
    low, high = np.percentile(drawn, (2.5, 97.5), axis=0)
    found = [
        {"value": float(v), "ci95": [float(a), float(b)]}
        for v, a, b in zip(_errors(gap, tows.force, spread), low, high)
    ]
    names = (*AXES, "pooled")
    return {"rmse": dict(zip(names, found[:3])), "nrmse": dict(zip(names, found[3:6])), "relative": found[6]}
