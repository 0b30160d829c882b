"""The elevation of a sea on a rectangular grid, as a product of matrices."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .waves import Waves


class Grid:
    """The surface of waves on the grid of x by y, ready to be summed at many times.

    cos(k_x x + k_y y + p) is made of a factor of x and one of y, so that the sum over n components on nx by ny points
    is one product of matrices of shapes (nx, 2 n) and (2 n, ny). Unlike a fast Fourier transform it takes any wave
    numbers, those of the plugin, and any spacing; the sea does not repeat from patch to patch.
    """

    def __init__(self, waves: "Waves", x: np.ndarray, y: np.ndarray, fade: bool = False):
        """Make the factors.

        Args:
            waves: the sea.
            x: [m], shape (nx,), ascending. y: [m], shape (ny,), ascending.
            fade: leave out what the grid cannot show: a wave counts less and less from four cells in its length to two.
        """
        self._waves = waves
        factors = []
        for axis, places in enumerate((np.asarray(x, float), np.asarray(y, float))):
            size = waves.wavenumber[:, axis]
            factor = np.exp(1j * np.outer(places, size))
            factors.append(factor * _shown(places, size) if fade else factor)
        self._along_x, along_y = factors[0], (waves.amplitude * factors[1]).T
        self._along_y = np.vstack([along_y.real, along_y.imag])

    def elevation(self, time: float, offset: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
        """Height of the surface above the still level [m] at a time [s], shape (nx, ny).

        offset: by which the whole grid is moved along x and y [m].
        """
        waves = self._waves
        phase = waves.phase + waves.wavenumber @ np.asarray(offset, float) - waves.frequency * time
        along_x = self._along_x * np.exp(1j * phase)
        return np.hstack([along_x.real, -along_x.imag]) @ self._along_y


def _shown(places: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Share of each wave that a spacing shows: 1 from four cells in its length on, 0 up to two; shape (places, n)."""
    cells = 2 * np.pi / np.maximum(np.abs(np.outer(np.gradient(places), size)), 1e-12)
    return np.clip(0.5 * (cells - 2), 0, 1)
