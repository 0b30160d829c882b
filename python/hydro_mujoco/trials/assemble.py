"""Signals of a window as a trial: rows, controls, start."""

from dataclasses import dataclass

import numpy as np

from ..errors import DataError
from .mapping.schema import Mapping
from .model import Model
from .report import Report
from .resample import CUTOFF, FASTER, GAP, SLOWER, SNAP, hold, linear, low_pass, near, slerp
from .signals import Signal, Signals
from .start import initial_state
from .trial import Trial
from .windows import Window
from .words import seconds

#: The least period of rows that is chosen where the mapping gives none [s].
LEAST_PERIOD = 0.02
#: A command that is older than this is said [s].
OLD = 1.0


@dataclass(frozen=True)
class Periods:
    """Seconds between rows of sensors, and between rows of controls."""

    rows: float
    controls: float


def periods(signals: Signals, mapping: Mapping, model: Model, report: Report) -> Periods:
    """The mapping's periods, in whole steps of the model; by default that of the fastest sensor, 0.01 s at least."""
    measured = [*signals.sensors.values(), *signals.joints.values()]
    fastest = min(signal.period for signal in measured)
    if not np.isfinite(fastest):
        raise DataError(f"{mapping.name}: no sensor has more than one sample in the log {report.log}")
    asked = mapping.time.period or max(fastest, LEAST_PERIOD)
    rows = max(round(asked / model.timestep), 1) * model.timestep
    if mapping.time.period and abs(rows - asked) > 1e-9 * asked:
        report.note(
            f"period {asked:g} s is no whole number of steps of the model ({model.timestep:g} s): {rows:g} s taken"
        )
    return Periods(rows, mapping.time.control_period or model.timestep)


def assemble(
    name: str, window: Window, signals: Signals, mapping: Mapping, model: Model, spacing: Periods, report: Report
) -> Trial | None:
    """The trial of a window; None where no row has a reading. A command is held until the next."""
    measured = {**signals.sensors, **signals.joints}
    first = min(measured.values(), key=lambda signal: signal.period)
    inside = first.times[window.within(first.times)]
    # A row on a sample of the fastest signal needs no interpolation there.
    start = float(inside[0]) if inside.size else window.start
    count = int(np.floor((window.stop - start) / spacing.rows + 1e-6)) + 1
    times = start + spacing.rows * np.arange(count)
    columns, places, at = [], {}, 0
    for key, signal in measured.items():
        values = readings(signal, times, spacing.rows)
        places[key] = list(range(at, at + values.shape[1]))
        at += values.shape[1]
        columns.append(values)
    table = np.concatenate(columns, axis=1)
    known = np.flatnonzero(np.isfinite(table).any(1))
    if known.size < 2:
        return None
    table, times = table[known[0] : known[-1] + 1], times[known[0] : known[-1] + 1]
    controls, control_times = _controls(times, signals, mapping, model, spacing, report)
    return Trial(
        name,
        float(times[0]),
        control_times,
        controls,
        tuple(model.actuators),
        times - times[0] + model.timestep,
        table,
        places,
        initial_state(model, signals, float(times[0])),
    )


def readings(signal: Signal, times: np.ndarray, period: float) -> np.ndarray:
    """A signal at the rows, (n, dim): low-passed if it is faster; if slower, in the rows next to its samples."""
    longest = GAP * max(signal.period, period)
    if signal.is_attitude:
        values = slerp(signal.times, signal.values, times, longest)
    else:
        values = linear(signal.times, signal.values, times, longest)
        if signal.source.filter and signal.period < FASTER * period:
            smooth, _ = low_pass(signal.times, signal.values, times, period)
            values = np.where(np.isfinite(values), smooth, np.nan)
    if signal.period > SLOWER * period:
        values[~near(signal.times, times, 0.5 * period)] = np.nan
    return values


def described(signal: Signal, period: float) -> str:
    """What becomes of a sensor's samples, in words."""
    said = f"{signal.times.size} samples of `{signal.source.topic}`, {seconds(signal.period)} apart"
    if signal.period > SLOWER * period:
        return f"{said}: a reading in the row next to each, by {_way(signal)} interpolation"
    if signal.period < FASTER * period:
        if signal.is_attitude or not signal.source.filter:
            return f"{said}: taken every {seconds(period)} by {_way(signal)} interpolation, not low-passed"
        middle = signal.times[signal.times.size // 2]
        rows = middle + period * np.arange(-20, 20)
        _, left = low_pass(signal.times, signal.values, rows, period)
        cutoff = CUTOFF / period
        return f"{said}: low-pass {cutoff:.3g} Hz, then every {seconds(period)}; of white noise {left:.2g} is left"
    return f"{said}: {_way(signal)} interpolation"


def _way(signal: Signal) -> str:
    return "spherical" if signal.is_attitude else "linear"


def _controls(
    times: np.ndarray, signals: Signals, mapping: Mapping, model: Model, spacing: Periods, report: Report
) -> tuple[np.ndarray, np.ndarray]:
    """Controls (m, nu) from the first row to the last, and their times from 0."""
    count = int(np.ceil((times[-1] - times[0]) / spacing.controls - 1e-6)) + 1
    at = times[0] + spacing.controls * np.arange(count)
    table = np.zeros((count, len(model.actuators)))
    for column, name in enumerate(model.actuators):
        constant = mapping.actuators[name].constant
        if constant is not None:
            table[:, column] = constant
            continue
        signal = signals.actuators[name]
        table[:, column] = hold(signal.times, signal.values, at + SNAP)[:, 0]
        last = np.searchsorted(signal.times, at, side="right") - 1
        age = at - signal.times[last.clip(0)]
        if age.max() > max(OLD, 5 * signal.period if np.isfinite(signal.period) else OLD):
            worst = int(age.argmax())
            report.note(f"`{name}`: no command for {seconds(float(age[worst]))} at {at[worst]:.3f} s of the log; held")
    return table, at - times[0]
