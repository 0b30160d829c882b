"""Errors of sensors as pure functions of a seed and of time."""

import zlib
from functools import lru_cache

import numpy as np

from ..errors import DataError

#: Largest seed.
LARGEST = 2**63 - 1
#: Components of a slow error: its distribution is normal to the eye, and its memory exp(-lag / T) on average.
COMPONENTS = 64


class Noise:
    """Standard normal numbers for one instrument.

    The same seed, instrument and time give the same numbers, so that a sensor has no memory to be copied or restored.
    They come from Philox (J. K. Salmon et al., SC 2011) with the seed and the instrument as its key and the time as its
    counter.
    """

    def __init__(self, seed: int, instrument: str):
        """Make the numbers of an instrument.

        Args:
            seed: 0 to 2^63 - 1. instrument: whatever tells it from others.

        Raises:
            DataError: the seed is no such number.
        """
        if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or not 0 <= seed <= LARGEST:
            raise DataError(f"seed is {seed!r}; expected a whole number, 0 to 2^63 - 1")
        self._key = zlib.crc32(instrument.encode()) << 64 | int(seed)

    def generator(self, time: float) -> np.random.Generator:
        """A generator that starts anew at each time [s]."""
        bits = int(np.float64(time).view(np.uint64))
        return np.random.Generator(np.random.Philox(key=self._key, counter=bits << 64))

    def constant(self, shape: int | tuple[int, ...] = ()) -> np.ndarray:
        """Numbers that stay the same for the seed: a bias from turn-on to turn-on."""
        return np.random.Generator(np.random.Philox(key=self._key, counter=1 << 128)).standard_normal(shape)

    def slow(self, time: float, time_constant: float, size: int) -> np.ndarray:
        """Numbers whose autocorrelation is exp(-lag / time_constant), shape (size,); times in s.

        A sum of cosines whose frequencies are drawn from that process's spectrum: M. Shinozuka and G. Deodatis, Applied
        Mechanics Reviews 44(4), 1991. Over one realisation the autocorrelation scatters.
        """
        frequency, phase = _components(self._key, size)
        return np.sqrt(2 / COMPONENTS) * np.cos(frequency / time_constant * time + phase).sum(axis=0)


@lru_cache(maxsize=256)
def _components(key: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, for a time constant of 1 s, and phases of the cosines of a slow error, each (COMPONENTS, size)."""
    draws = np.random.Generator(np.random.Philox(key=key, counter=2 << 128)).random((2, COMPONENTS, size))
    # Frequencies one a stratum of the Cauchy distribution, whose characteristic function is that autocorrelation.
    share = (np.arange(COMPONENTS)[:, None] + draws[0]) / COMPONENTS
    return np.tan(0.5 * np.pi * share), 2 * np.pi * draws[1]
