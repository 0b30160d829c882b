"""Error of a reduced precision, in standard deviations of the force."""

import numpy as np


def axis_error(found, expected, axes: int) -> float:
    """Worst axis of RMS(found - expected) / standard deviation of expected; both [samples * axes]."""
    found, expected = (np.asarray(values, float).reshape(-1, axes) for values in (found, expected))
    return float((np.sqrt(((found - expected) ** 2).mean(0)) / expected.std(0)).max())
