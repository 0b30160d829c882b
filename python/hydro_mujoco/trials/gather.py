"""Mapped fields of a log, read and brought into the model's units and frames."""

from collections import Counter
from collections.abc import Iterable

import numpy as np

from ..errors import DataError
from . import frames
from .clock import LOG, Ordered, clock_field, ordered, suspect_mixed
from .continuity import Continuity
from .geodetic import is_fix, local
from .log import Log, Samples
from .log.table import TableLog
from .mapping.schema import Mapping, Source, Water
from .report import Report
from .scratch import Table, blocks, some
from .signals import Signal, Signals
from .turning import turned
from .units import ATTITUDE, LENGTH, PRESSURE, PULSE, UNITS
from .words import counted, listed, nearest

#: Departure of the median length of quaternions from 1 that is said.
QUATERNION_TOLERANCE = 0.05


def gather(log: Log, mapping: Mapping, report: Report) -> Signals:
    """Read what a mapping names and bring it into the model's units and frames.

    Raises:
        DataError: the log lacks a topic or a field, or a topic has no sample.
    """
    reader = _Reader(log, mapping, report)
    states = [source for parts in mapping.state.values() for source in parts.values()]
    turns = [source.turn.attitude for source in mapping.sensors.values() if source.turn]
    sources = [*mapping.sensors.values(), *mapping.actuators.values(), *mapping.joints.values(), *states, *turns]
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
    """The samples of all sources, read in one pass; those of a topic go once the last source has taken them."""

    def __init__(self, log: Log, mapping: Mapping, report: Report):
        self._log, self._mapping, self._report = log, mapping, report
        self._samples: dict[str, Samples] = {}
        self._users: Counter[str] = Counter()
        self._orders: dict[tuple[str, str | None], Ordered] = {}
        self._columns = log.columns() if isinstance(log, TableLog) else None
        self._origin = mapping.origin

    def read(self, sources: Iterable[Source]) -> None:
        wanted: dict[str, list[str]] = {}
        places: dict[str, str] = {}
        for source in sources:
            clock = self._clock(source.clock)
            paths = [*filter(None, source.fields), *([clock] if clock else [])]
            wanted.setdefault(source.topic, []).extend(paths)
            places.setdefault(source.topic, source.where)
            self._users[source.topic] += 1
        if mode := self._mapping.trials.mode:
            clock = self._clock(LOG)
            wanted.setdefault(mode[0], []).extend([mode[1], *([clock] if clock else [])])
            places.setdefault(mode[0], f"{self._mapping.name}, [trials] mode")
            self._users[mode[0]] += 1
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
        """A source's samples, converted block by block."""
        samples = self._samples[source.topic]
        order = self._ordered(source.topic, self._clock(source.clock))
        places = [samples.fields.index(path) if path else -1 for path in source.fields]
        if source.frame == frames.GEODETIC:
            self._set_origin(samples, order, places, source)
        if source.quantity == ATTITUDE and len(places) == 4:
            self._check_lengths(_columns(samples, order.rows[some(len(order.rows))], places), source)
        attitude = self.signal(f"attitude of {name}", source.turn.attitude) if source.turn else None
        goes_on = Continuity(source.quantity)
        dim = 4 if source.quantity == ATTITUDE else len(places)
        times, values = Table(1), Table(dim)
        # Rows by which of their components are numbers.
        patterns: Counter[tuple[bool, ...]] = Counter()
        for block in blocks(len(order.rows)):
            at = order.times[block]
            found = self._converted(_columns(samples, order.rows[block], places), source)
            goes_on.go_on(found)
            if attitude and source.turn:
                found = turned(at, found, attitude, source.turn)
            finite = np.isfinite(found)
            known = finite.any(1)
            patterns.update({tuple(row): int(n) for row, n in zip(*np.unique(finite, axis=0, return_counts=True))})
            times.append(at[known] - source.delay)
            values.append(found[known])
        self._let_go(source.topic)
        if source.turn:
            self._report.note(
                f"`{name}`: the velocity in {source.frame} is turned into the {source.turn.into} by "
                f"`{source.turn.attitude.topic}`"
            )
        if not len(times):
            why = "; the attitude that turns it has no sample at its times" if source.turn else ""
            raise DataError(
                f"{source.where}: none of the {len(order.rows)} samples in `{source.topic}` is a number{why}"
            )
        if goes_on.jumps:
            self._report.note(f"`{name}`: {counted(goes_on.jumps, 'jump')} by a turn taken out")
        logged = np.array(list(patterns)).any(0)
        if lost := sum(n for pattern, n in patterns.items() if not np.array(pattern)[logged].all()):
            self._report.note(f"`{name}`: {counted(lost, 'sample')} with a value that is no number")
        return Signal(name, times.array()[:, 0], values.array(), source)

    def _ordered(self, topic: str, clock: str | None) -> Ordered:
        """Times of a topic by a clock; sources that share both share them."""
        if (topic, clock) not in self._orders:
            samples = self._samples[topic]
            self._orders[topic, clock] = ordered(topic, samples, clock, self._mapping.time, self._report)
        return self._orders[topic, clock]

    def _let_go(self, topic: str) -> None:
        """One source less needs the samples of a topic."""
        self._users[topic] -= 1
        if not self._users[topic]:
            del self._samples[topic]
            self._orders = {key: order for key, order in self._orders.items() if key[0] != topic}

    def _converted(self, raw: np.ndarray, source: Source) -> np.ndarray:
        """Rows in the model's units and frames."""
        values = _physical(raw, source, self._mapping.water)
        if source.quantity == ATTITUDE:
            return self._attitude(values, source)
        if source.frame == frames.GEODETIC:
            assert self._origin is not None
            values = _turned(local(values, self._origin), frames.rotation("ENU", self._mapping.frames[0]))
        elif source.frame:
            into = self._mapping.frames[source.frame in frames.BODY]
            values = _turned(values, frames.rotation(source.frame, into))
        return values

    def _set_origin(self, samples: Samples, order: Ordered, places: list[int], source: Source) -> None:
        """Where the mapping says nothing, the world's zero is at the first fix; what is no fix is said."""
        lost = 0
        for block in blocks(len(order.rows)):
            rows = _columns(samples, order.rows[block], places)
            there = is_fix(rows)
            lost += int((~there).sum())
            if self._origin is None and there.any():
                first = _physical(rows[there][:1], source, self._mapping.water)[0]
                height = first[2] if np.isfinite(first[2]) else 0.0
                self._origin = (float(np.degrees(first[0])), float(np.degrees(first[1])), float(height))
        if lost:
            self._report.note(f"`{source.topic}`: {counted(lost, 'sample')} without a fix")
        if self._origin is None:
            raise DataError(f"{source.where}: none of the {lost} samples in `{source.topic}` has a fix")
        latitude, longitude, height = self._origin
        whose = "`origin`" if self._mapping.origin else "the first fix; `origin` in [model] sets it"
        self._report.note(
            f"the world's zero is at latitude {latitude:.7f}, longitude {longitude:.7f} degrees, height {height:.2f} m"
            f": {whose}"
        )

    def mode(self) -> Signal | None:
        """1 where the mode is one of the trials', else 0."""
        if (mode := self._mapping.trials.mode) is None:
            return None
        topic, path, values = mode
        samples = self._samples[topic]
        wanted = [self._log.words.get(v, np.nan) if isinstance(v, str) else float(v) for v in values]
        order, place = self._ordered(topic, self._clock(LOG)), samples.fields.index(path)
        table, met = Table(1), set()
        for block in blocks(len(order.rows)):
            found = _columns(samples, order.rows[block], [place])[:, 0]
            met.update(np.unique(found).tolist())
            table.append(np.isin(found, wanted))
        if met.isdisjoint(wanted):
            words = {number: word for word, number in self._log.words.items()}
            said = sorted({str(words.get(value, f"{value:g}")) for value in met})
            raise DataError(
                f"{self._mapping.name}, [trials] mode: `{path}` of `{topic}` is never {listed(map(str, values))}; "
                f"it is {listed(said)}"
            )
        return Signal("mode", order.times, table.array(), Source("", topic=topic))

    def _clock(self, clock: str | None) -> str | None:
        return clock_field(clock or self._mapping.time.clock, self._log, self._columns)

    def _attitude(self, values: np.ndarray, source: Source) -> np.ndarray:
        """Unit quaternions in the model's frames."""
        if values.shape[1] == 3:
            found = frames.from_euler(values)
        else:
            found = values if source.order == "wxyz" else values[:, [3, 0, 1, 2]]
            lengths = np.linalg.norm(found, axis=1)
            found = np.where((lengths > 0.1)[:, None], found / np.maximum(lengths, 1e-12)[:, None], np.nan)
        if source.inverse:
            found = frames.inverse(found)
        own = "/".join(self._mapping.frames)
        return frames.attitude(found, source.frame or own, self._mapping.frames)

    def _check_lengths(self, raw: np.ndarray, source: Source) -> None:
        lengths = np.linalg.norm(_physical(raw, source, self._mapping.water), axis=1)
        middle = float(np.nanmedian(lengths)) if np.isfinite(lengths).any() else np.nan
        if not abs(middle - 1) <= QUATERNION_TOLERANCE:
            self._report.suspect(f"the quaternions of `{source.topic}` have a length of {middle:.4g}, not 1")


def _columns(samples: Samples, rows: np.ndarray, places: list[int]) -> np.ndarray:
    """Columns of rows, NaN where the place is -1."""
    at = rows.astype(int)
    found = np.full((len(at), len(places)), np.nan)
    for column, place in enumerate(places):
        if place >= 0:
            found[:, column] = samples.values[at, place]
    return found


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
