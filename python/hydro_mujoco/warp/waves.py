"""Components of linear waves, from the attribute `waves`: listed, or drawn of a spectrum (crates/effects/src/sea)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Lowest and highest frequency of a spectrum in parts of its peak's; cells of that band, and of the half circle.
BAND = (0.35, 4.0)
CELLS = 8192
#: Fraction of the golden section: multiples of it, less their whole parts, lie evenly for any count.
GOLDEN = (np.sqrt(5) - 1) / 2
#: Stream of random numbers of a spectrum.
STREAM = 1
#: What a file may leave out.
PEAK_ENHANCEMENT, COMPONENTS, SEED = 3.3, 60, 0
#: Share of the energy in the shortest waves that no one notices.
UNNOTICED = 0.01


@dataclass(frozen=True)
class Waves:
    """Waves whose elevation is the sum of amplitude cos(wavenumber . (x, y) - frequency t + phase).

    Attributes:
        amplitude: [m], shape (n,). frequency: [rad/s], shape (n,). phase: [rad], shape (n,).
        wavenumber: along world x and y [rad/m], shape (n, 2).
        depth: of the water [m]; infinite where it is deep. gravity: [m/s^2].
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    phase: np.ndarray
    wavenumber: np.ndarray
    depth: float
    gravity: float

    @property
    def upward(self) -> np.ndarray:
        """exp(-2 k depth): all goes with depth as exp(k z) plus or minus this times exp(-k z)."""
        return np.exp(-2 * np.linalg.norm(self.wavenumber, axis=1) * self.depth)

    @property
    def pressure(self) -> np.ndarray:
        """Factor of that sum in the dynamic pressure by density [m^2/s^2]."""
        return self.gravity * self.amplitude / (1 + self.upward)

    @property
    def shortest_length(self) -> float:
        """Length [m] of the shortest wave but for those with 1 % of the energy together; infinite without any."""
        there = self.amplitude > 0
        if not there.any():
            return np.inf
        length = 2 * np.pi / np.linalg.norm(self.wavenumber[there], axis=1)
        order = np.argsort(length)
        energy = np.cumsum(self.amplitude[there][order] ** 2)
        return float(length[order][np.argmax(energy > UNNOTICED * energy[-1])])


def waves(document: dict[str, Any], gravity: float) -> Waves:
    """The waves of a `hydro-waves/1` that the plugin has read and found right. gravity: [m/s^2]."""
    depth = float(document.get("depth", np.inf))
    amplitude, frequency, direction, phase = _spectrum(document) if "spectrum" in document else _list(document)
    k = np.array([wavenumber(each, depth, gravity) for each in frequency])
    along = np.stack([np.cos(direction), np.sin(direction)], axis=1)
    return Waves(amplitude, frequency, phase, k[:, np.newaxis] * along, depth, gravity)


def wavenumber(frequency: float, depth: float, gravity: float) -> float:
    """Wave number k [rad/m] with frequency^2 = gravity k tanh(k depth), by Newton's method."""
    deep = frequency**2 / gravity
    a = deep * depth
    if a > 20:
        return deep
    x = a / np.sqrt(np.tanh(a))
    for _ in range(8):
        tanh = np.tanh(x)
        x -= (x * tanh - a) / (tanh + x * (1 - tanh**2))
    return float(x / depth)


def _list(document: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Amplitudes [m], frequencies [rad/s], directions and phases [rad] of listed waves."""
    listed = document["components"]
    amplitude = [wave["amplitude"] if "amplitude" in wave else wave["height"] / 2 for wave in listed]
    frequency = [2 * np.pi / wave["period"] for wave in listed]
    angles = [[np.deg2rad(wave.get(name, 0.0)) for wave in listed] for name in ("direction", "phase")]
    return np.array(amplitude, dtype=float), np.array(frequency), np.array(angles[0]), np.array(angles[1])


def _spectrum(document: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The same of a spectrum: parts of equal energy, one component each, at random within its part."""
    count, seed = int(document.get("components", COMPONENTS)), int(document.get("seed", SEED))
    drawn = np.array([_uniform(seed, index) for index in range(count)])
    index = np.arange(count)
    x = _quantiles(_density(document), *BAND, (index + drawn[:, 0]) / count)
    direction = np.full(count, np.deg2rad(document.get("direction", 0.0)))
    if document.get("spreading") is not None:
        share = (drawn[0, 2] + index * GOLDEN) % 1
        exponent = float(document["spreading"])
        angle = _quantiles(lambda angle: ((1 + np.cos(angle)) / 2) ** exponent, 0, np.pi, np.abs(2 * share - 1))
        direction = direction + np.copysign(angle, 2 * share - 1)
    amplitude = np.full(count, document["significant_height"] / 4 * np.sqrt(2 / count))
    return amplitude, 2 * np.pi / document["peak_period"] * x, direction, 2 * np.pi * drawn[:, 1]


def _density(document: dict[str, Any]) -> Callable[[np.ndarray], np.ndarray]:
    """The spectrum's density, up to a factor, by the frequency in parts of the peak's."""
    enhancement = document.get("peak_enhancement", PEAK_ENHANCEMENT) if document["spectrum"] == "jonswap" else 1.0

    def density(x: np.ndarray) -> np.ndarray:
        width = np.where(x <= 1, 0.07, 0.09)
        return x**-5.0 * np.exp(-1.25 * x**-4.0) * enhancement ** np.exp(-0.5 * ((x - 1) / width) ** 2)

    return density


def _quantiles(
    density: Callable[[np.ndarray], np.ndarray], lower: float, upper: float, share: np.ndarray
) -> np.ndarray:
    """Points below which shares of a density lie, by the trapezoidal rule."""
    points = np.linspace(lower, upper, CELLS + 1)
    values = density(points)
    below = np.concatenate([[0], np.cumsum((values[1:] + values[:-1]) / 2)])
    return np.interp(share, below / below[-1], points)


def _uniform(seed: int, counter: int) -> np.ndarray:
    """Four numbers between 0 and 1: Philox-4x64 with ten rounds, as NumPy has it, which counts before it draws."""
    generator = np.random.Philox(key=seed + (STREAM << 64), counter=(counter - 1) % 2**256)
    return ((generator.random_raw(4) >> np.uint64(12)).astype(float) + 0.5) * np.finfo(float).eps
