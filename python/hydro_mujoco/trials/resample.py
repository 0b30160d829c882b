"""Signals on other times. Nothing is extrapolated: outside of what was measured a value is NaN."""

import numpy as np

from .frames import continuous

#: A row this near to a sample stands on it [s].
SNAP = 1e-6
#: Samples this many periods apart, or of the rows', have a gap between them.
GAP = 2.5
#: Period of the samples over that of the rows: below, samples are low-passed; above, rows between samples stay empty.
FASTER, SLOWER = 0.67, 1.5
#: Cut-off of the low-pass as a share of the rows' rate, and half its length in periods of the rows.
CUTOFF, HALF_LENGTH = 0.4, 4.0
#: Samples that are filtered at a time, those of neighbouring rows counted anew.
BLOCK = 1 << 18


def bracketed(times: np.ndarray, rows: np.ndarray, longest: float) -> np.ndarray:
    """True for rows on a sample, or between two that are `longest` seconds apart at most."""
    if not times.size:
        return np.zeros(rows.size, bool)
    after = np.searchsorted(times, rows - SNAP, side="left").clip(0, times.size - 1)
    before = (np.searchsorted(times, rows + SNAP, side="right") - 1).clip(0)
    inside = (rows >= times[0] - SNAP) & (rows <= times[-1] + SNAP)
    return inside & (times[after] - times[before] <= longest)


def near(times: np.ndarray, rows: np.ndarray, distance: float) -> np.ndarray:
    """True for the row nearest to each sample, where it is within `distance` seconds."""
    found = np.zeros(rows.size, bool)
    after = np.searchsorted(rows, times).clip(1, max(rows.size - 1, 1))
    nearest = np.where(times - rows[after - 1] <= rows[after] - times, after - 1, after) if rows.size > 1 else times * 0
    nearest = nearest.astype(int)
    found[nearest[np.abs(rows[nearest] - times) <= distance]] = True
    return found


def linear(times: np.ndarray, values: np.ndarray, rows: np.ndarray, longest: float) -> np.ndarray:
    """Values (n, k) at `rows`, linear between finite samples that are `longest` apart at most."""
    found = np.full((rows.size, values.shape[1]), np.nan)
    for column in range(values.shape[1]):
        finite = np.isfinite(values[:, column])
        known = bracketed(times[finite], rows, longest)
        if known.any():
            found[known, column] = np.interp(rows[known], times[finite], values[finite, column])
    return found


def low_pass(times: np.ndarray, values: np.ndarray, rows: np.ndarray, period: float) -> tuple[np.ndarray, float]:
    """Values at `rows` without what is faster than CUTOFF / period, and the share of white noise that is left.

    A windowed sinc without delay, its weights taken at the samples' own times, so that they need not be even.
    """
    half = HALF_LENGTH * period
    found, noise = np.full((rows.size, values.shape[1]), np.nan), []
    first, last = np.searchsorted(times, rows - half), np.searchsorted(times, rows + half, side="right")
    most = int((last - first).max(initial=0))
    step = max(BLOCK // max(most, 1), 1)
    for start in range(0, rows.size if most else 0, step):
        block = slice(start, start + step)
        places = first[block, None] + np.arange(most)
        inside = places < last[block, None]
        places = places.clip(0, times.size - 1)
        away = times[places] - rows[block, None]
        weights = np.sinc(2 * CUTOFF * away / period) * np.cos(0.5 * np.pi * away / half) ** 2 * inside
        taken = values[places]
        weights = weights[:, :, None] * np.isfinite(taken)
        total = weights.sum(1)
        with np.errstate(invalid="ignore", divide="ignore"):
            found[block] = (weights * np.nan_to_num(taken)).sum(1) / total
            left = np.sqrt((weights**2).sum(1)) / np.abs(total)
        noise.append(left[np.isfinite(left)])
    return found, float(np.median(np.concatenate(noise))) if noise and np.concatenate(noise).size else 1.0


def hold(times: np.ndarray, values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The last value at or before each row; NaN before the first."""
    finite = np.isfinite(values).all(1)
    times, values = times[finite], values[finite]
    last = np.searchsorted(times, rows, side="right") - 1
    found = values[last.clip(0)].astype(float)
    found[last < 0] = np.nan
    return found


def slerp(times: np.ndarray, quaternions: np.ndarray, rows: np.ndarray, longest: float) -> np.ndarray:
    """Unit quaternions (n, 4) at `rows`, by spherical linear interpolation."""
    finite = np.isfinite(quaternions).all(1)
    times, quaternions = times[finite], continuous(quaternions[finite])
    found = np.full((rows.size, 4), np.nan)
    known = bracketed(times, rows, longest)
    if not known.any():
        return found
    after = (
        np.searchsorted(times, rows[known], side="right").clip(1, max(times.size - 1, 1)) if times.size > 1 else None
    )
    if after is None:
        found[known] = quaternions[0]
        return found
    one, other = quaternions[after - 1], quaternions[after]
    share = ((rows[known] - times[after - 1]) / (times[after] - times[after - 1])).clip(0, 1)[:, None]
    angle = np.arccos(np.clip((one * other).sum(1, keepdims=True), -1.0, 1.0))
    small = angle < 1e-6
    divisor = np.where(small, 1.0, np.sin(angle))
    mixed = np.where(
        small,
        one + share * (other - one),
        (np.sin((1 - share) * angle) * one + np.sin(share * angle) * other) / divisor,
    )
    found[known] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return continuous(found)
