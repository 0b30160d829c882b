"""The walk over learning rates: doubled or halved while the error falls."""

import math
from collections.abc import Callable

from . import TrainingError

#: A step that lowers the error by less is no gain.
GAIN = 0.01


def search(error: Callable[[float, int], float], first: float) -> float:
    """The rate of least error: `error(rate, seed)` is infinite where a training diverged.

    Errors fall and then rise with the rate, or the search ends in the dip that is nearest to the first one.
    """
    known = {first: error(first, 0)}
    at = first
    for factor in (2.0, 0.5):
        while (rate := at * factor) not in known:
            known[rate] = error(rate, 0)
            # Every training diverges here: a higher rate gains nothing.
            if not known[rate] < known[at] * (1 - GAIN) and not (factor < 1 and math.isinf(known[at])):
                break
            at = rate
            if at < 1e-6:
                raise TrainingError("diverged at every rate")
    best = sorted((rate for rate in known if math.isfinite(known[rate])), key=known.__getitem__)[:2]
    return min(best, key=lambda rate: known[rate] * error(rate, 1))
