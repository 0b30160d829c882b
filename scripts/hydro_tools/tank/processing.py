"""Raw traces processed to hydrodynamic force: zero, drift, low-pass, start-up cut, mean with its error.

1. The mean over the rest before a tow is its zero, that over the rest after it the zero it has drifted
   to; the straight line between them is taken off. Gravity, buoyancy and the amplifier go with it.
2. A Butterworth low-pass of fourth order, run both ways: no phase, and the carriage's vibration gone.
3. The first START_UP metres at speed are cut, and the last second before the brake.
4. Mean and spread of what is left. The standard error adds, as squares: batch means of the steady
   part (its vortices have a memory); the noise of the zeros; what a random walk may do between the
   zeros, its intensity taken from how unsteadily the zeros of the runs drift; the cell's alignment.

Force along x and y, base frame. The truth in a file is never looked at.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from hydro_mujoco import DataError

from .cell import MISALIGNMENT
from .conditions import Condition
from .motion import START_UP
from .recording import Run

#: Low-pass [Hz], and what is cut before the brake, where its ramp leaks in [s].
CUT_OFF, BEFORE_BRAKE = 3.0, 1.0
#: Batches for the error of a mean.
BATCHES = 6


@dataclass(frozen=True)
class Steady:
    """The steady part of one tow: time [K] s since the run began, force [K,2] N; mean, spread, error [2] N."""

    condition: Condition
    time: np.ndarray
    force: np.ndarray
    mean: np.ndarray
    spread: np.ndarray
    error: np.ndarray


def _zeros(run: Run) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means [4,3] N of the four spells of rest, before each tow and at the end; their variances; when [4] s."""
    if run.reading.ndim != 2 or run.reading.shape[1] != 3 or not np.isfinite(run.reading).all():
        raise DataError(
            f"a run's reading is {run.reading.shape} with {np.sum(~np.isfinite(run.reading))} numbers "
            "that are none: expected finite readings [N, 3]"
        )
    time = np.arange(len(run.reading)) / run.rate
    ends = np.append(run.marks[:, 0], len(run.reading) / run.rate)
    inside = [(time >= end - run.rest - 1e-9) & (time < end - 1e-9) for end in ends]
    still = [0.0, *run.marks[:, 3]]
    short = [
        end
        for end, rows, since in zip(ends, inside, still)
        if rows.sum() < 0.9 * run.rest * run.rate or end - run.rest < since - 1e-9
    ]
    if short:
        raise DataError(
            f"a run of {len(run.reading) / run.rate:.1f} s lacks the {run.rest} s of rest that end at {short[0]:.1f} s"
        )
    zeros = np.array([run.reading[rows].mean(axis=0) for rows in inside])
    variances = np.array([run.reading[rows].var(axis=0, ddof=1) / rows.sum() for rows in inside])
    return zeros, variances, ends - run.rest / 2


def walk(run: Run) -> float:
    """Intensity [N^2/s] of the random walk in the run's zeros; few numbers, so average it over runs of one cell.

    The slope over a time T scatters by the intensity / T about the steady rate, which the straight line takes off.
    """
    zeros, _, at = _zeros(run)
    if len(zeros) < 3:
        raise DataError(f"a run of {len(run.marks)} tow does not show how its zero wanders: give the intensity")
    spans = np.diff(at)[:, None]
    slopes = np.diff(zeros, axis=0) / spans
    rate = np.sum(slopes * spans, axis=0) / spans.sum()
    return float(np.mean(np.sum(spans * (slopes - rate) ** 2, axis=0) / (len(spans) - 1)))


def bridge(start: float, end: float, whole: float) -> float:
    """Variance of the mean over [start, end] of a random walk of unit intensity that is zero at 0 and at `whole`."""
    return start + (end - start) / 3.0 - (start + end) ** 2 / (4.0 * whole)


def steady(run: Run, intensity: float | None = None) -> list[Steady]:
    """The three tows of a run; intensity: of the random walk [N^2/s], the run's own estimate by default."""
    zeros, zero_variance, middles = _zeros(run)
    time = np.arange(len(run.reading)) / run.rate
    if intensity is None:
        intensity = walk(run)
    smooth = sosfiltfilt(butter(4, CUT_OFF, fs=run.rate, output="sos"), run.reading, axis=0)

    out = []
    for k, (index, (_, reach, brake, _)) in enumerate(zip(run.condition, run.marks)):
        condition = Condition(int(index))
        start, end = reach + START_UP / condition.speed, brake - BEFORE_BRAKE
        rows = (time >= start) & (time < end)
        if rows.sum() < BATCHES:
            raise DataError(f"condition {index}: no steady part between {start:.1f} and {end:.1f} s of its run")
        share = ((time[rows] - middles[k]) / (middles[k + 1] - middles[k]))[:, None]
        force = smooth[rows] - (1 - share) * zeros[k] - share * zeros[k + 1]
        mean = force.mean(axis=0)
        batches = np.array([part.mean(axis=0) for part in np.array_split(force, BATCHES)])
        at = share.mean()
        variance = (
            batches.var(axis=0, ddof=1) / BATCHES
            + (1 - at) ** 2 * zero_variance[k]
            + at**2 * zero_variance[k + 1]
            + intensity * bridge(start - middles[k], end - middles[k], middles[k + 1] - middles[k])
            + MISALIGNMENT**2 * (mean @ mean - mean**2)
        )
        out.append(Steady(condition, time[rows], force[:, :2], mean[:2], force.std(axis=0)[:2], np.sqrt(variance)[:2]))
    return out
