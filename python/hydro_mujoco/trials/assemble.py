"""Signals of windows as trials: rows, controls, start."""

from dataclasses import dataclass

import numpy as np

from ..errors import DataError
from .continuity import Continuity
from .mapping.schema import Mapping
from .model import Model
from .report import Report
from .resample import CUTOFF, FASTER, GAP, HALF_LENGTH, SLOWER, SNAP, hold, linear, low_pass, near, slerp
from .scratch import Table, blocks
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


class Assembly:
    """The trials of a log, built on disk a block of rows at a time. A command is held until the next."""

    def __init__(self, signals: Signals, mapping: Mapping, model: Model, spacing: Periods, report: Report):
        self._signals, self._mapping, self._model = signals, mapping, model
        self._spacing, self._report = spacing, report
        self._measured = {**signals.sensors, **signals.joints}
        self._places: dict[str, list[int]] = {}
        for name, signal in self._measured.items():
            at = sum(map(len, self._places.values()))
            self._places[name] = list(range(at, at + signal.values.shape[1]))
        # Time in the trial, then readings, or commands.
        self._rows = Table(1 + sum(map(len, self._places.values())))
        self._controls = Table(1 + len(model.actuators))
        self._drafts: list[_Draft] = []

    def __len__(self) -> int:
        return len(self._drafts)

    def add(self, name: str, window: Window) -> None:
        """Build the trial of a window; none where fewer than two rows have a reading."""
        start, count = self._grid(window)
        first, known = len(self._rows), []
        endings = {name: Continuity(signal.source.quantity) for name, signal in self._measured.items()}
        for block in blocks(count, self._rows.columns):
            # With the rows beside the block: a slow sample counts in the row nearest to it.
            wide = np.arange(max(block.start - 1, 0), min(block.stop + 1, count))
            times, own = start + self._spacing.rows * wide, (wide >= block.start) & (wide < block.stop)
            columns = [times[own, None]]
            for key, signal in self._measured.items():
                values = readings(signal, times, self._spacing.rows)[own]
                if signal.is_attitude:
                    endings[key].go_on(values)
                columns.append(values)
            table = np.concatenate(columns, axis=1)
            found = block.start + np.flatnonzero(np.isfinite(table[:, 1:]).any(1))
            known += [*found[:2], *found[-1:]]
            self._rows.append(table)
        if len(set(known)) < 2:
            return
        start, stop = (start + self._spacing.rows * np.array([known[0], known[-1]])).tolist()
        rows = slice(first + int(known[0]), first + int(known[-1]) + 1)
        controls = self._command(start, stop)
        self._drafts.append(_Draft(name, start, rows, controls, initial_state(self._model, self._signals, start)))

    def trials(self) -> list[Trial]:
        """All that were built."""
        rows, controls = self._rows.array(), self._controls.array()
        for draft in self._drafts:
            times = rows[draft.rows, 0]
            for block in blocks(len(times)):
                times[block] = times[block] - draft.start + self._model.timestep
        return [
            Trial(
                draft.name,
                draft.start,
                controls[draft.controls, 0],
                controls[draft.controls, 1:],
                tuple(self._model.actuators),
                rows[draft.rows, 0],
                rows[draft.rows, 1:],
                dict(self._places),
                draft.initial_state,
            )
            for draft in self._drafts
        ]

    def _grid(self, window: Window) -> tuple[float, int]:
        """Time of the first row in the log [s], and the number of rows."""
        fastest = min(self._measured.values(), key=lambda signal: signal.period)
        # A row on a sample of the fastest signal needs no interpolation there.
        at = int(np.searchsorted(fastest.times, window.start - SNAP))
        inside = at < fastest.times.size and fastest.times[at] <= window.stop + SNAP
        start = float(fastest.times[at]) if inside else window.start
        return start, int(np.floor((window.stop - start) / self._spacing.rows + 1e-6)) + 1

    def _command(self, start: float, stop: float) -> slice:
        """Controls from the first row to the last; their rows."""
        spacing, first = self._spacing.controls, len(self._controls)
        oldest: dict[str, tuple[float, float]] = {}
        for block in blocks(int(np.ceil((stop - start) / spacing - 1e-6)) + 1, self._controls.columns):
            away = spacing * np.arange(block.start, block.stop)
            at = start + away
            table = np.zeros((len(at), 1 + len(self._model.actuators)))
            table[:, 0] = at - start
            for column, name in enumerate(self._model.actuators, start=1):
                constant = self._mapping.actuators[name].constant
                if constant is not None:
                    table[:, column] = constant
                    continue
                times, values = self._signals.actuators[name].within(at[0], at[-1] + SNAP)
                table[:, column] = hold(times, values, at + SNAP)[:, 0]
                age = at - times[(np.searchsorted(times, at, side="right") - 1).clip(0)]
                worst = int(age.argmax())
                oldest[name] = max(oldest.get(name, (-np.inf, 0.0)), (float(age[worst]), float(at[worst])))
            self._controls.append(table)
        for name, (age, when) in oldest.items():
            period = self._signals.actuators[name].period
            if age > max(OLD, 5 * period if np.isfinite(period) else OLD):
                self._report.note(f"`{name}`: no command for {seconds(age)} at {when:.3f} s of the log; held")
        return slice(first, len(self._controls))


@dataclass(frozen=True)
class _Draft:
    """A trial whose numbers are on disk."""

    name: str
    start: float
    rows: slice
    controls: slice
    initial_state: np.ndarray | None


def readings(signal: Signal, rows: np.ndarray, period: float) -> np.ndarray:
    """A signal at the rows, (n, dim): low-passed if it is faster; if slower, in the rows next to its samples."""
    longest = GAP * max(signal.period, period)
    margin = max(longest, HALF_LENGTH * period) + SNAP
    times, logged = signal.within(rows[0] - margin, rows[-1] + margin)
    if signal.is_attitude:
        values = slerp(times, logged, rows, longest)
    else:
        values = linear(times, logged, rows, longest)
        if signal.source.filter and signal.period < FASTER * period:
            smooth, _ = low_pass(times, logged, rows, period)
            values = np.where(np.isfinite(values), smooth, np.nan)
    if signal.period > SLOWER * period:
        values[~near(times, rows, 0.5 * period)] = np.nan
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
