"""Linear waves: a sum of components in place and time, the same as the plugin's (crates/effects/src/sea)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from . import spectrum
from .dispersion import wavenumber

#: Numbers of a block of points times components.
BLOCK = 2**20
#: Share of the energy in the shortest waves that no one notices.
UNNOTICED = 0.01


@dataclass(frozen=True)
class Waves:
    """Airy's waves: elevation = sum of amplitude cos(wavenumber . (x, y) - frequency t + phase).

    World frame, z up from the still level [m]; water does not move beyond its depth.

    Attributes:
        amplitude: [m], shape (n,).
        frequency: angular [rad/s], shape (n,).
        wavenumber: along world x and y [rad/m], shape (n, 2).
        phase: [rad], shape (n,).
        depth: of the water [m]; infinity where it is deep.
        gravity: [m/s^2].

    Source: R. G. Dean and R. A. Dalrymple, Water Wave Mechanics for Engineers and Scientists, World Scientific 1991,
    chapters 3 and 4. Above the still level velocity and pressure are those at it.
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    wavenumber: np.ndarray
    phase: np.ndarray
    depth: float
    gravity: float

    @classmethod
    def read(cls, document: Mapping[str, Any], gravity: float) -> Self:
        """The waves of a document `hydro-waves/1` that the plugin has accepted, under gravity [m/s^2]."""
        depth = document.get("depth", np.inf)
        if "spectrum" in document:
            amplitude, frequency, direction, phase = spectrum.draw(document, depth, gravity)
        else:
            amplitude, frequency, direction, phase = _listed(document["components"])
        size = wavenumber(frequency, depth, gravity)
        along = np.stack([size * np.cos(direction), size * np.sin(direction)], axis=1)
        return cls(amplitude, frequency, along, phase, depth, gravity)

    @cached_property
    def size(self) -> np.ndarray:
        """Length of each wave number [rad/m], shape (n,)."""
        return np.hypot(*self.wavenumber.T)

    @cached_property
    def upward(self) -> np.ndarray:
        """exp(-2 k depth), shape (n,): all goes with z as exp(k z) plus or minus this times exp(-k z)."""
        return np.exp(-2 * self.size * self.depth)

    @cached_property
    def pressure_scale(self) -> np.ndarray:
        """Factor of that sum in the dynamic pressure by density [m^2/s^2], shape (n,)."""
        return self.gravity * self.amplitude / (1 + self.upward)

    @property
    def shortest_length(self) -> float:
        """Length [m] of the shortest wave but for those with 1 % of the energy together; infinite without any."""
        there = self.amplitude > 0
        if not there.any():
            return np.inf
        length = 2 * np.pi / self.size[there]
        order = np.argsort(length)
        energy = np.cumsum(self.amplitude[there][order] ** 2)
        return float(length[order][np.argmax(energy > UNNOTICED * energy[-1])])

    @property
    def significant_height(self) -> float:
        """Four times the standard deviation of the elevation [m]."""
        return float(4 * np.sqrt(0.5 * np.sum(self.amplitude**2)))

    def elevation(self, x: np.ndarray | float, y: np.ndarray | float, time: float) -> np.ndarray:
        """Height of the surface above the still level [m], of the shape that x and y [m] broadcast to; time in s."""
        places = np.stack(np.broadcast_arrays(x, y), axis=-1).astype(float)
        return self._in_blocks(places, lambda at: np.cos(self._phase(at, time)) @ self.amplitude)

    def velocity(self, points: np.ndarray, time: float) -> np.ndarray:
        """Velocity of the water [m/s] at points [m] of shape (..., 3), z from the still level; the same shape."""

        def sums(at: np.ndarray) -> np.ndarray:
            phase, (level, upright) = self._phase(at, time), self._by_depth(at[:, 2:])
            flat = (level * np.cos(phase) / self.frequency) @ self.wavenumber
            up = (upright * np.sin(phase)) @ (1 / self.frequency)
            return np.column_stack([flat, up])

        return self._in_blocks(points, sums)

    def pressure(self, points: np.ndarray, time: float) -> np.ndarray:
        """Dynamic pressure by density [m^2/s^2] at points [m] of shape (..., 3), z as in `velocity`; shape (...)."""

        def sums(at: np.ndarray) -> np.ndarray:
            return (self._by_depth(at[:, 2:])[0] * np.cos(self._phase(at, time))).sum(axis=1)

        return self._in_blocks(points, sums)

    def _phase(self, at: np.ndarray, time: float) -> np.ndarray:
        """Phase of each component [rad] at places of shape (p, 2 or 3); shape (p, n)."""
        return at[:, :2] @ self.wavenumber.T + (self.phase - self.frequency * time)

    def _by_depth(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """g a cosh(k (z + d)) / cosh(k d) and k times the same with sinh, for z of shape (p, 1); each (p, n)."""
        size = self.size
        z = np.clip(z, -self.depth, 0)
        # exp(-700) is as small as a double can take.
        down, bed, scale = np.exp(np.maximum(size * z, -700)), self.upward, self.pressure_scale
        return scale * (down + bed / down), scale * size * (down - bed / down)

    def _in_blocks(self, points: np.ndarray, sums: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """`sums` of points of shape (..., k), as many at a time as fit a block."""
        points = np.asarray(points, float)
        flat, rows = points.reshape(-1, points.shape[-1]), max(1, BLOCK // len(self.amplitude))
        parts = [sums(flat[start : start + rows]) for start in range(0, len(flat), rows)] or [sums(flat)]
        whole = np.concatenate(parts)
        return whole.reshape(points.shape[:-1] + whole.shape[1:])


def _listed(components: list[Mapping[str, float]]) -> tuple[np.ndarray, ...]:
    """Amplitudes, angular frequencies, directions and phases of listed waves, in SI units."""
    amplitude = [wave["amplitude"] if "amplitude" in wave else 0.5 * wave["height"] for wave in components]
    angles = [np.radians([wave.get(key, 0.0) for wave in components]) for key in ("direction", "phase")]
    frequency = [2 * np.pi / wave["period"] for wave in components]
    return np.array(amplitude, float), np.array(frequency), *angles
