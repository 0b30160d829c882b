"""Mapped fields of a log as signals in the model's units and frames."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import DataError
from . import frames
from .clock import LOG, clock_field, ordered, suspect_mixed
from .log import Log, Samples
from .log.table import TOPIC
from .mapping.schema import Mapping, Source, Water
from .report import Report
from .units import ANGLE, ATTITUDE, LENGTH, PRESSURE, PULSE, UNITS
from .words import counted, listed, nearest

#: Departure of the median length of quaternions from 1 that is said.
QUATERNION_TOLERANCE = 0.05


@dataclass(frozen=True)
class Signal:
    """Samples of a sensor, actuator, joint or state.

    times: [s] of the log, increasing, (n,); values: (n, dim), NaN where the log has none.
    """

    name: str
    times: np.ndarray
    values: np.ndarray
    source: Source

    @property
    def period(self) -> float:
        """Median time between samples [s]; of fewer than two, infinite."""
        return float(np.median(np.diff(self.times))) if self.times.size > 1 else np.inf

    @property
    def is_attitude(self) -> bool:
        """True for quaternions."""
        return self.source.quantity == ATTITUDE


@dataclass(frozen=True)
class Signals:
    """All signals of a log, by name. state: body or joint -> part -> signal; mode: of the topic that splits."""

    sensors: dict[str, Signal]
    actuators: dict[str, Signal]
    joints: dict[str, Signal]
    state: dict[str, dict[str, Signal]]
    mode: Signal | None


def gather(log: Log, mapping: Mapping, report: Report) -> Signals:
    """Read what a mapping names and bring it into the model's units and frames.

    Raises:
        DataError: the log lacks a topic or a field, or a topic has no sample.
    """
    reader = _Reader(log, mapping, report)
    states = [source for parts in mapping.state.values() for source in parts.values()]
    sources = [*mapping.sensors.values(), *mapping.actuators.values(), *mapping.joints.values(), *states]
    reader.read(source for source in sources if source.constant is None)
    signals = Signals(
        {name: reader.signal(name, source) for name, source in mapping.sensors.items()},
        {name: reader.signal(name, source) for name, source in mapping.actuators.items() if source.constant is None},
        {name: reader.signal(name, source) for name, source in mapping.joints.items()},
        {
            key: {part: reader.signal(f"{key} {part}", source) for part, source in parts.items()}
            for key, parts in mapping.state.items()
        },
        reader.mode(),
    )
    suspect_mixed(report)
    for fault in log.faults:
        report.suspect(fault)
    return signals


class _Reader:
    """The samples of all sources, read in one pass."""

    def __init__(self, log: Log, mapping: Mapping, report: Report):
        self._log, self._mapping, self._report = log, mapping, report
        self._samples: dict[str, Samples] = {}
        self._columns = list(log.topics()[TOPIC].fields) if log.is_table else None

    def read(self, sources: Iterable[Source]) -> None:
        wanted: dict[str, list[str]] = {}
        places: dict[str, str] = {}
        for source in sources:
            clock = self._clock(source.clock)
            paths = [*filter(None, source.fields), *([clock] if clock else [])]
            wanted.setdefault(source.topic, []).extend(paths)
            places.setdefault(source.topic, source.where)
        if mode := self._mapping.trials.mode:
            clock = self._clock(LOG)
            wanted.setdefault(mode[0], []).extend([mode[1], *([clock] if clock else [])])
            places.setdefault(mode[0], f"{self._mapping.name}, [trials] mode")
        wanted = {topic: list(dict.fromkeys(paths)) for topic, paths in wanted.items()}
        self._samples = self._log.read(wanted)
        for topic in wanted:
            if topic not in self._samples:
                there = self._log.topics()
                raise DataError(
                    f"{places[topic]}: the log {self._log.path} has no message of topic "
                    f"`{topic}`{nearest(topic, there)}; "
                    f"it holds {listed(there)}"
                )

    def signal(self, name: str, source: Source) -> Signal:
        """A source's samples, converted."""
        samples = self._samples[source.topic]
        order = ordered(source.topic, samples, self._clock(source.clock), self._mapping.time, self._report)
        places = [samples.fields.index(path) if path else -1 for path in source.fields]
        raw = np.full((order.rows.size, len(places)), np.nan)
        for column, place in enumerate(places):
            if place >= 0:
                raw[:, column] = samples.values[order.rows, place]
        values = _physical(raw, source, self._mapping.water)
        if source.quantity == ATTITUDE:
            values = self._attitude(values, source)
        else:
            if source.frame:
                into = self._mapping.frames[source.frame in frames.BODY]
                values = _turned(values, frames.rotation(source.frame, into))
            if source.quantity == ANGLE:
                values = self._unwrapped(name, values)
        logged = values[:, ~np.isnan(values).all(0)]
        if not np.isfinite(logged).any():
            raise DataError(f"{source.where}: none of the {len(values)} samples in `{source.topic}` is a number")
        if lost := int((~np.isfinite(logged)).any(1).sum()):
            self._report.note(f"`{name}`: {counted(lost, 'sample')} with a value that is no number")
        known = np.isfinite(values).any(1)
        return Signal(name, order.times[known] - source.delay, values[known], source)

    def mode(self) -> Signal | None:
        """1 where the mode is one of the trials', else 0."""
        if (mode := self._mapping.trials.mode) is None:
            return None
        topic, path, values = mode
        samples = self._samples[topic]
        wanted = [self._log.words.get(v, np.nan) if isinstance(v, str) else float(v) for v in values]
        found = samples.values[:, samples.fields.index(path)]
        if not np.isin(found, wanted).any():
            words = {number: word for word, number in self._log.words.items()}
            met = sorted({str(words.get(value, f"{value:g}")) for value in np.unique(found)})
            raise DataError(
                f"{self._mapping.name}, [trials] mode: `{path}` of `{topic}` is never {listed(map(str, values))}; "
                f"it is {listed(met)}"
            )
        order = ordered(topic, samples, self._clock(LOG), self._mapping.time, self._report)
        return Signal("mode", order.times, np.isin(found[order.rows], wanted)[:, None], Source("", topic=topic))

    def _clock(self, clock: str | None) -> str | None:
        return clock_field(clock or self._mapping.time.clock, self._log, self._columns)

    def _attitude(self, values: np.ndarray, source: Source) -> np.ndarray:
        if values.shape[1] == 3:
            found = frames.from_euler(values)
        else:
            found = values if source.order == "wxyz" else values[:, [3, 0, 1, 2]]
            lengths = np.linalg.norm(found, axis=1)
            middle = float(np.nanmedian(lengths)) if np.isfinite(lengths).any() else np.nan
            if not abs(middle - 1) <= QUATERNION_TOLERANCE:
                self._report.suspect(f"the quaternions of `{source.topic}` have a length of {middle:.4g}, not 1")
            found = np.where((lengths > 0.1)[:, None], found / np.maximum(lengths, 1e-12)[:, None], np.nan)
        if source.inverse:
            found = frames.inverse(found)
        own = "/".join(self._mapping.frames)
        return frames.attitude(found, source.frame or own, self._mapping.frames)

    def _unwrapped(self, name: str, values: np.ndarray) -> np.ndarray:
        column = values[:, 0]
        finite = np.isfinite(column)
        turned = np.unwrap(column[finite])
        if jumps := int((np.abs(np.diff(turned - column[finite])) > 1).sum()):
            self._report.note(f"`{name}`: {counted(jumps, 'jump')} by a turn taken out")
        values[finite, 0] = turned
        return values


def _physical(raw: np.ndarray, source: Source, water: Water) -> np.ndarray:
    """Raw numbers in SI, scaled and moved."""
    values = raw.copy()
    for column, unit in enumerate(source.units):
        if source.table:
            points, wanted = zip(*source.table)
            values[:, column] = np.interp(raw[:, column], points, wanted)
        elif unit is not None:
            measured, factor = UNITS[unit]
            values[:, column] *= factor
            if measured == PULSE:
                assert source.pulse is not None
                order = np.argsort(source.pulse)
                widths, ends = np.array(source.pulse)[order], np.array([-1.0, 0.0, 1.0])[order]
                values[:, column] = np.interp(raw[:, column], widths, ends)
            if measured == PRESSURE and source.quantity == LENGTH:
                height = (water.surface_pressure - values[:, column]) / (water.density * water.gravity)
                values[:, column] = height + water.surface
    return values * np.array(source.scale) + np.array(source.offset)


def _turned(values: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Vectors turned; a component is NaN only where one that it is made of is."""
    turned = np.zeros_like(values)
    for row in range(3):
        for column in range(3):
            if abs(matrix[row, column]) > 1e-12:
                turned[:, row] += matrix[row, column] * values[:, column]
    return turned
