"""Uncertainty of a measured mean about the model.

    sd^2 = (standard error)^2 + (share * typical)^2

The first is the tank's. The second is the error of the model's form, which no coefficient repairs: like the force it
grows with the speed squared, so it is a share of the force that is typical of a tow's speed, direction and axis. The
share is such that the residuals' chi-square equals their degrees of freedom. Across a symmetry (force y of a tow
along x) nothing is typical, and the tank's error remains.
"""

import numpy as np
from scipy.optimize import brentq

from .measurements import Measurements

#: Largest share that is looked for: a model that errs by five times the force.
LARGEST = 5.0


def typical(tows: Measurements) -> np.ndarray:
    """Typical force [N,2] N of each tow's direction, axis and speed: the best k of |force| = k speed^2."""
    out = np.empty_like(tows.force)
    square = tows.speed[:, None] ** 2
    for direction in np.unique(tows.direction):
        rows = tows.direction == direction
        weight = tows.error[rows] ** -2.0
        slope = (weight * square[rows] * tows.force[rows]).sum(axis=0) / (weight * square[rows] ** 2).sum(axis=0)
        out[rows] = np.abs(slope) * square[rows]
    return out


def share(gap: np.ndarray, error: np.ndarray, scale: np.ndarray, freedom: float) -> float:
    """Share of `scale` [N,2] N at which gaps [N,2] N have a chi-square of `freedom`; 0 where errors explain them."""

    def excess(value: float) -> float:
        return float((gap**2 / (error**2 + (value * scale) ** 2)).sum() - freedom)

    if excess(0.0) <= 0.0:
        return 0.0
    if excess(LARGEST) > 0.0:
        return LARGEST
    return float(brentq(excess, 0.0, LARGEST, xtol=1e-6))
