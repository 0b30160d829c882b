"""Random numbers as a pure function of a seed, a stream and a counter, the same as the plugin's.

Philox-4x64 with ten rounds (J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC 2011), by NumPy.
"""

import numpy as np

#: Streams of crates/effects/src/sea/random.rs.
WAVES, CURRENT = 1, 2


def uniform(seed: int, stream: int, counter: int, rows: int = 1) -> np.ndarray:
    """Four numbers between 0 and 1, never 0 or 1, for each of `rows` counters from `counter` on; shape (rows, 4)."""
    # NumPy raises its counter before it draws.
    before = (counter - 1) % 2**256
    words = np.random.Philox(counter=before, key=stream << 64 | seed).random_raw(4 * rows)
    return ((words >> np.uint64(12)).astype(float) + 0.5).reshape(rows, 4) * 2.0**-52


def normal(seed: int, stream: int, counter: int) -> np.ndarray:
    """Four independent numbers of the standard normal distribution, shape (4,).

    Source: G. E. P. Box and M. E. Muller, Annals of Mathematical Statistics 29, 1958.
    """
    pairs = uniform(seed, stream, counter).reshape(2, 2)
    radius, angle = np.sqrt(-2 * np.log(pairs[:, 0])), 2 * np.pi * pairs[:, 1]
    return (radius * np.array([np.cos(angle), np.sin(angle)])).T.ravel()
