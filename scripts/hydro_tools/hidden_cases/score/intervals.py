"""Intervals: Clopper and Pearson's for a share, the bootstrap's for a median."""

import math

import numpy as np


def share(hits: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """Exact binomial interval (C. Clopper, E. Pearson, Biometrika 26 (1934) 404); (0, 1) without data."""
    if total == 0:
        return 0.0, 1.0
    tail = (1 - level) / 2
    low = 0.0 if hits == 0 else _solve(lambda p: 1 - _below(hits - 1, total, p), tail)
    high = 1.0 if hits == total else _solve(lambda p: -_below(hits, total, p), -tail)
    return low, high


def median(values: list[float], level: float = 0.95, draws: int = 2000) -> tuple[float, float, float]:
    """Median and its bootstrap interval; NaN without data."""
    if not values:
        return math.nan, math.nan, math.nan
    data = np.asarray(values, float)
    rng = np.random.default_rng(0)
    medians = np.median(data[rng.integers(0, len(data), (draws, len(data)))], axis=1)
    low, high = np.quantile(medians, [(1 - level) / 2, (1 + level) / 2])
    return float(np.median(data)), float(low), float(high)


def _below(k: int, n: int, p: float) -> float:
    """P(X <= k) of a binomial."""
    if p <= 0:
        return 1.0
    if p >= 1:
        return 1.0 if k >= n else 0.0
    logs = [
        math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) + i * math.log(p) + (n - i) * math.log1p(-p)
        for i in range(k + 1)
    ]
    return math.fsum(math.exp(value) for value in logs)


def _solve(rising, wanted: float) -> float:
    """p in (0, 1) at which a rising function equals `wanted`."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        if rising(middle) < wanted:
            low = middle
        else:
            high = middle
    return (low + high) / 2
