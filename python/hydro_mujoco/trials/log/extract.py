"""Messages, one after another, into columns of numbers or into a listing."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...errors import DataError
from .base import Columns, Log, Samples, Topic
from .fields import ABSENT, getter, kinds

#: What decoders raise on a damaged message.
UNDECODED = (ValueError, IndexError, KeyError, TypeError, AttributeError, UnicodeError, ArithmeticError, BufferError)
_PLAIN = (float, int, bool, np.floating, np.integer, np.bool_)


class Extractor:
    """Fields of messages, {topic: paths}, gathered message by message."""

    def __init__(self, log: Log, wanted: Mapping[str, Sequence[str]]):
        self._log = log
        self._getters = {topic: [(path, getter(path)) for path in paths] for topic, paths in wanted.items()}
        self._columns = {topic: Columns(paths) for topic, paths in wanted.items()}
        self._undecoded: dict[str, int] = {}

    def add(self, topic: str, stamp: int, decode: Callable[[], object]) -> None:
        """A message of a topic. stamp: log time [ns]."""
        time = self._log.since_start(stamp)
        try:
            message = decode()
        except UNDECODED:
            self._undecoded[topic] = self._undecoded.get(topic, 0) + 1
            return
        values = []
        for path, get in self._getters[topic]:
            try:
                value = get(message)
            except ABSENT:
                raise self._log.no_field(topic, path, kinds(message)) from None
            values.append(float(value) if isinstance(value, _PLAIN) else self._log.number(value, path, topic))
        self._columns[topic].add(time, values)

    def samples(self) -> dict[str, Samples]:
        """What was gathered; a topic without a message is left out."""
        found = {topic: columns.samples() for topic, columns in self._columns.items()}
        for topic, number in self._undecoded.items():
            if not len(found[topic].times):
                raise DataError(f"{self._log.path}, topic `{topic}`: none of its {number} messages can be decoded")
            self._log.faults.append(f"topic `{topic}`: {number} messages cannot be decoded and were left out")
        return {topic: samples for topic, samples in found.items() if len(samples.times)}


class Lister:
    """Topics of a log, met message by message."""

    def __init__(self) -> None:
        self._types: dict[str, str] = {}
        self._counts: dict[str, int] = {}
        self._spans: dict[str, tuple[int, int]] = {}
        self._fields: dict[str, Mapping[str, str]] = {}

    def add(self, topic: str, kind: str, stamp: int, decode: Callable[[], object]) -> None:
        """A message of a topic. stamp: [ns]."""
        self._types[topic] = kind
        self._counts[topic] = self._counts.get(topic, 0) + 1
        first, last = self._spans.get(topic, (stamp, stamp))
        self._spans[topic] = min(first, stamp), max(last, stamp)
        if topic not in self._fields:
            try:
                self._fields[topic] = kinds(decode())
            except UNDECODED:
                self._fields[topic] = {}

    def topics(self) -> dict[str, Topic]:
        """All topics, sorted."""
        spans = {name: (last - first) * 1e-9 for name, (first, last) in self._spans.items()}
        return {
            name: Topic(name, self._types[name], self._counts[name], self._fields[name], spans[name])
            for name in sorted(self._types)
        }
