"""Medians, quartiles, and ratios taken block by block."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Spread:
    """Median and quartiles of some numbers."""

    median: float
    low: float
    high: float

    def scaled(self, factor: float) -> "Spread":
        """In another unit."""
        return Spread(self.median * factor, self.low * factor, self.high * factor)


def spread(values) -> Spread:
    """Median and quartiles."""
    low, median, high = np.quantile(np.asarray(values, float), [0.25, 0.5, 0.75])
    return Spread(float(median), float(low), float(high))


def ratio(of, to) -> Spread:
    """Median and quartiles of `of[i] / to[i]`, over the rounds that both took part in."""
    rounds = min(len(of), len(to))
    return spread(np.asarray(of[:rounds], float) / np.asarray(to[:rounds], float))
