"""Signals on other times, and the pieces of a log, against what they are by definition."""

from unittest import mock

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydro_mujoco.trials import resample, scratch, windows


@given(st.lists(st.lists(st.integers(0, 60), min_size=1, max_size=12, unique=True), min_size=1, max_size=4), st.integers(1, 9), st.sampled_from([8, 24, 1000]))  # fmt: skip
@settings(max_examples=120, deadline=None)
def test_pieces_are_those_of_all_times_together(series, gap, numbers):
    with mock.patch.object(scratch, "NUMBERS", numbers):
        found = windows._without_gaps([np.sort(np.array(times, float)) for times in series], gap)
    times = np.unique(np.concatenate(series))
    ends = np.flatnonzero(np.diff(times) > gap)
    expected = zip(times[[0, *(ends + 1)]], times[[*ends, len(times) - 1]])
    assert [(piece.start, piece.stop) for piece in found] == list(expected)


@given(st.lists(st.floats(0.001, 0.2), min_size=3, max_size=60), st.floats(0.005, 0.3), st.randoms())
@settings(max_examples=80, deadline=None)
def test_resampling_invents_nothing(steps, period, random):
    times = np.cumsum(steps)
    values = np.array(
        [[random.uniform(-1, 1), np.nan if random.random() < 0.2 else random.uniform(-1, 1)] for _ in times]
    )
    rows = np.arange(times[0] - 1, times[-1] + 1, period)
    found = resample.linear(times, values, rows, 0.15)
    inside = np.isfinite(found[:, 0])
    assert (np.abs(found[inside, 0]) <= np.abs(values[:, 0]).max() + 1e-12).all()
    assert not inside[(rows < times[0] - 2e-6) | (rows > times[-1] + 2e-6)].any()
    held = resample.hold(times, values[:, :1], rows)[:, 0]
    assert set(held[np.isfinite(held)]) <= set(values[:, 0]) and np.isnan(held[rows < times[0]]).all()
    smooth, left = resample.low_pass(times, np.ones((times.size, 1)), rows, period)
    np.testing.assert_allclose(smooth[np.isfinite(smooth)], 1)
    on = resample.linear(times, values, times, 0.15)
    np.testing.assert_allclose(on[np.isfinite(on[:, 0]), 0], values[np.isfinite(on[:, 0]), 0])
    assert left > 0


def test_a_low_pass_keeps_slow_and_takes_fast():
    times = np.arange(0, 20, 0.001) + 1e-4 * np.sin(np.arange(20000))
    rows = np.arange(1, 19, 0.02)

    def gain(frequency):
        wave = np.sin(2 * np.pi * frequency * times)[:, None]
        found, _ = resample.low_pass(times, wave, rows, 0.02)
        return float(np.abs(found[:, 0]).max()), float(np.abs(found[:, 0] - np.sin(2 * np.pi * frequency * rows)).max())

    assert gain(1)[1] < 0.01 and gain(5)[1] < 0.02
    assert gain(45)[0] < 0.05 and gain(120)[0] < 0.05
    noise = np.random.default_rng(1).standard_normal((times.size, 3))
    found, left = resample.low_pass(times, noise, rows, 0.02)
    assert found.std() == pytest.approx(left, rel=0.1) and left < 0.3


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3))
@settings(max_examples=40, deadline=None)
def test_slerp_turns_evenly(x, y, z):
    rate = np.array([x, y, z])
    times = np.arange(0, 2, 0.05)

    def turned(at):
        found = np.zeros((at.size, 4))
        size = np.linalg.norm(rate)
        for row, time in enumerate(at):
            mujoco.mju_axisAngle2Quat(found[row], rate / size if size else np.array([1.0, 0, 0]), size * time)
        return found

    rows = np.arange(-0.3, 2.3, 0.013)
    found = resample.slerp(times, turned(times) * np.where(np.arange(times.size) % 3, 1, -1)[:, None], rows, 0.2)
    inside = (rows >= 0) & (rows <= times[-1])
    assert np.isnan(found[~inside]).all()
    np.testing.assert_allclose(np.abs((found[inside] * turned(rows[inside])).sum(1)), 1, atol=1e-9)
