"""Excitation signals: tables of rows, each within [-1, 1]."""

import numpy as np


def multisine(
    rng: np.random.Generator,
    rows: int,
    period: float,
    channels: int,
    *,
    lowest: float = 0.05,
    highest: float = 1.0,
    tones: int = 6,
) -> np.ndarray:
    """Sums of sines at random phases [rows, channels]; frequencies [Hz] spread evenly in their logarithm."""
    t = np.arange(rows) * period
    out = np.zeros((rows, channels))
    for channel in range(channels):
        frequencies = np.geomspace(lowest, highest, tones) * rng.uniform(0.85, 1.15, tones)
        phases = rng.uniform(0, 2 * np.pi, tones)
        # Start near zero, so that a vehicle at rest is not kicked.
        signal = np.sin(2 * np.pi * np.outer(t, frequencies) + phases) @ (1 / frequencies**0.3)
        out[:, channel] = signal / np.abs(signal).max()
    return out * ramp(rows, period)[:, None]


def chirp(
    rng: np.random.Generator, rows: int, period: float, *, lowest: float = 0.05, highest: float = 1.5
) -> np.ndarray:
    """A sine whose frequency [Hz] grows evenly in its logarithm [rows]."""
    t = np.arange(rows) * period
    span = t[-1]
    rate = np.log(highest / lowest)
    phase = 2 * np.pi * lowest * span / rate * (np.exp(rate * t / span) - 1)
    return np.sin(phase + rng.choice([0.0, np.pi])) * ramp(rows, period)


def steps(rng: np.random.Generator, rows: int, period: float, channels: int, *, hold: float = 1.5) -> np.ndarray:
    """Levels held for about `hold` s [rows, channels], with edges of three rows."""
    out = np.zeros((rows, channels))
    for channel in range(channels):
        at = 0
        while at < rows:
            length = max(int(rng.uniform(0.6, 1.6) * hold / period), 4)
            out[at : at + length, channel] = rng.choice([0.0, *rng.uniform(-1, 1, 2)])
            at += length
    kernel = np.ones(3) / 3
    return np.stack([np.convolve(column, kernel, "same") for column in out.T], 1) * ramp(rows, period)[:, None]


def pulses(rng: np.random.Generator, rows: int, period: float, channels: int) -> np.ndarray:
    """One channel at a time pushes for half a second, in random order [rows, channels]."""
    out = np.zeros((rows, channels))
    width, gap = int(0.5 / period), int(0.35 / period)
    at, order = int(0.3 / period), []
    while at + width < rows:
        if not order:
            order = list(rng.permutation(channels))
        window = np.hanning(width + 2)[1:-1] ** 0.3
        out[at : at + width, order.pop()] = rng.uniform(0.5, 1.0) * rng.choice([-1, 1]) * window
        at += width + gap
    return out


def ramp(rows: int, period: float, rise: float = 0.5) -> np.ndarray:
    """A ramp from 0 to 1 over the first `rise` s."""
    return np.minimum(np.arange(rows) * period / rise, 1.0)
