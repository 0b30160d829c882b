"""The log of a trial, made from the truth's readings: filter, sampling, jitter, noise, dropouts.

Analogue sensors have an anti-alias filter of first order, 20 to 40 Hz. The logger takes out the filter's delay (its
time constant), as a data sheet would advise, so a log of the nominal itself shows no delay.
"""

from dataclasses import dataclass

import numpy as np

from .frames import exponential, product
from .strength import Layout


@dataclass(frozen=True)
class Recorder:
    """Sampling, filter and noise of a case's logs."""

    cutoff: float  # Hz
    jitter: float  # s, standard deviation of the sampling instants
    dropout: float  # share of rows in which one sensor is lost (NaN)
    missing: float  # share of rows that are missing altogether


def recorder(rng: np.random.Generator, period: float) -> Recorder:
    """A recorder for a case; most are clean, some jitter, most drop a little."""
    return Recorder(
        cutoff=float(rng.uniform(20, 40)),
        jitter=float(rng.choice([0.0, 0.0, 0.0, 0.05, 0.1]) * period),
        dropout=float(rng.choice([0.0, 0.005, 0.02])),
        missing=float(rng.choice([0.0, 0.0, 0.01])),
    )


def filtered(values: np.ndarray, step: float, cutoff: float) -> np.ndarray:
    """First-order low pass of [T, ns], by the trapezoid rule."""
    tau = 1 / (2 * np.pi * cutoff)
    keep, take = (2 * tau - step) / (2 * tau + step), step / (2 * tau + step)
    out = np.empty_like(values)
    state = values[0].copy()
    out[0] = state
    pushed = take * (values[1:] + values[:-1])
    for k in range(len(pushed)):
        state = keep * state + pushed[k]
        out[k + 1] = state
    return out


def sample(times: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Linear interpolation of [T, ns] at instants."""
    step = times[1] - times[0]
    place = np.clip((at - times[0]) / step, 0, len(times) - 1 - 1e-9)
    whole = place.astype(int)
    part = (place - whole)[:, None]
    return values[whole] * (1 - part) + values[whole + 1] * part


def log(
    rng: np.random.Generator,
    recorder: Recorder,
    layout: Layout,
    times: np.ndarray,
    values: np.ndarray,
    *,
    rows: int,
    period: float,
    lead: float,
) -> tuple[np.ndarray, np.ndarray]:
    """(labels [K], rows [K, ns]) of one trial from its fine readings. A row labelled t reads the state at t - lead."""
    step = times[1] - times[0]
    labels = np.arange(1, rows + 1) * period
    if recorder.jitter:
        labels = labels + np.clip(rng.normal(0, recorder.jitter, rows), -0.3 * period, 0.3 * period)
        labels[0] = max(labels[0], lead)
    data = sample(times, values, labels - lead)
    for width in sorted(set(layout.bandwidth.values()) - {np.inf}):
        cutoff = recorder.cutoff * width
        own = np.concatenate(
            [np.arange(c.start, c.stop) for name, c in layout.columns.items() if layout.bandwidth[name] == width]
        )
        smooth = filtered(values[:, own], step, cutoff)
        data[:, own] = sample(times, smooth, labels - lead + 1 / (2 * np.pi * cutoff))
    for name, columns in layout.columns.items():
        width = columns.stop - columns.start
        if name in layout.quaternions:
            q = data[:, columns]
            q = q / np.linalg.norm(q, axis=1, keepdims=True)
            # The noise of an attitude is that of its rotation vector [rad], each component.
            data[:, columns] = product(q, exponential(rng.normal(0, layout.noise[name], (rows, 3))))
        else:
            data[:, columns] += rng.normal(0, layout.noise[name], (rows, width))
    names = list(layout.columns)
    for row in np.flatnonzero(rng.random(rows) < recorder.dropout):
        data[row, layout.columns[names[int(rng.integers(len(names)))]]] = np.nan
    kept = rng.random(rows) >= recorder.missing
    kept[0] = True
    return labels[kept], data[kept]
