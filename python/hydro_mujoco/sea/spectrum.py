"""Components that stand for a spectrum of wind waves, the same as the plugin's (crates/effects/src/sea/spectrum.rs)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import random
from .dispersion import wavenumber

#: Lowest and highest frequency in parts of the peak's; cells of the band, and of half the circle.
BAND, CELLS = (0.35, 4.0), 8192
#: Fraction of the golden section.
GOLDEN = 0.6180339887498949
#: What a document leaves out.
PEAK_ENHANCEMENT, INVERSE_WAVE_AGE, COMPONENTS, SEED = 3.3, 0.84, 60, 0


def draw(
    document: Mapping[str, Any], depth: float, gravity: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Amplitudes [m], angular frequencies [rad/s], directions [rad] and phases [rad], each of shape (n,).

    The spectrum is cut into n parts of equal energy, with one component each at a random place in its part; directions
    are quantiles of the spreading cos^2s of half the angle.

    Args:
        document: `hydro-waves/1` with a `spectrum`, as the plugin has accepted it.
        depth: of the water [m], infinite where it is deep. gravity: [m/s^2].
    """
    number = document.get("components", COMPONENTS)
    numbers = random.uniform(document.get("seed", SEED), random.WAVES, 0, number)
    index = np.arange(number)
    grid = np.linspace(*BAND, CELLS + 1)
    share = (index + numbers[:, 0]) / number
    peak = 2 * np.pi / document["peak_period"]
    density = _density(document, grid)
    if document["spectrum"] == "tma":
        density = density * _saturation(depth * wavenumber(peak * grid, depth, gravity))
    frequency = peak * _quantile(grid, density, share)
    direction = np.full(number, np.radians(document.get("direction", 0.0)))
    if "spreading" in document:
        side = 2 * np.mod(numbers[0, 2] + index * GOLDEN, 1) - 1
        angle = np.linspace(0, np.pi, CELLS + 1)
        density = (0.5 * (1 + np.cos(angle))) ** document["spreading"]
        direction += np.copysign(_quantile(angle, density, np.abs(side)), side)
    amplitude = np.full(number, 0.25 * document["significant_height"] * np.sqrt(2 / number))
    return amplitude, frequency, direction, 2 * np.pi * numbers[:, 1]


def _density(document: Mapping[str, Any], x: np.ndarray) -> np.ndarray:
    """Energy at a frequency x in parts of the peak's, up to a factor.

    Sources: W. J. Pierson and L. Moskowitz, J. Geophysical Research 69, 1964; K. Hasselmann et al., Deutsche
    Hydrographische Zeitschrift A8(12), 1973 (JONSWAP); T. Elfouhaily et al., J. Geophysical Research 102(C7), 1997
    (ECKV).
    """
    developed, shape = x**-5 * np.exp(-1.25 * x**-4), document["spectrum"]
    if shape == "pierson_moskowitz":
        return developed
    if shape == "eckv":
        age = document.get("inverse_wave_age", INVERSE_WAVE_AGE)
        gamma, width = 1.7 + 6 * np.log10(max(age, 1.0)), 0.08 * (1 + 4 * age**-3.0)
        developed = developed * x * np.exp(-age * (x - 1) / np.sqrt(10))
    else:
        gamma, width = document.get("peak_enhancement", PEAK_ENHANCEMENT), np.where(x <= 1, 0.07, 0.09)
    return developed * gamma ** np.exp(-0.5 * ((x - 1) / width) ** 2)


def _saturation(kd: np.ndarray) -> np.ndarray:
    """Share of the energy in deep water that waves have in water of a depth, by wave number times depth.

    Source: S. A. Kitaigorodskii, V. P. Krasitskii, M. M. Zaslavskii, J. Physical Oceanography 5, 1975.
    """
    # Beyond 20 it is 1 to the last bit.
    shallow = np.minimum(kd, 20.0)
    return np.where(kd > 20, 1.0, np.tanh(shallow) ** 2 / (1 + 2 * shallow / np.sinh(2 * shallow)))


def _quantile(grid: np.ndarray, density: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Points of an even grid below which a share, 0 to 1, of a density lies; linear in each cell."""
    below = np.concatenate([[0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    below /= below[-1]
    last = len(grid) - 2
    cell = np.clip(np.searchsorted(below, share, side="right") - 1, 0, last)
    left, right = below[cell], below[cell + 1]
    within = np.divide(share - left, right - left, out=np.zeros_like(left), where=right > left)
    return grid[0] + (cell + np.clip(within, 0, 1)) * (grid[-1] - grid[0]) / (len(grid) - 1)
