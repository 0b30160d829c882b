"""PX4 ULog files."""

import contextlib
import io
import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...extras import extra
from .base import NUMBER, Columns, Log, Samples, Topic
from .stream import Stream, refuse_empty

#: Seconds of a microsecond.
MICRO = 1e-6
#: Bytes of a topic's messages that are gathered before the wanted fields are taken from them.
PIECE = 1 << 20


class UlogLog(Log):
    """A ULog file, read by pyulog a message at a time; of a topic that is asked for the wanted fields are kept.

    A further instance of a topic is `NAME[1]`; the log time is the field `timestamp`, since boot.
    """

    kind = "ULog file"

    def __init__(self, path: Path):
        refuse_empty(path)
        super().__init__(path)
        extra("pyulog", "ulog", self.kind)
        self.start = 0

    def topics(self) -> dict[str, Topic]:
        counted = self._parsed(_counting(), [])
        return {
            name: Topic(
                name,
                message.message_name,
                counted.counts.get(number, 0),
                {field.field_name: NUMBER for field in message.field_data},
                (counted.spans[number][1] - counted.spans[number][0]) * MICRO if number in counted.spans else None,
            )
            for number, message in sorted(counted.listed.items(), key=lambda pair: pair[1].message_name)
            if (name := _name(message.message_name, message.multi_id)) and counted.counts.get(number)
        }

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        columns: dict[str, Columns] = {}

        def kept(name: str, instance: int, layout: np.dtype) -> list[tuple[Columns, list[str]]]:
            found, there = [], layout.names or ()
            for topic in sorted({_name(name, instance), f"{name}[{instance}]"} & set(wanted)):
                for path in wanted[topic]:
                    if path not in there:
                        raise self.no_field(topic, path, there)
                found.append((columns.setdefault(topic, Columns(wanted[topic])), list(wanted[topic])))
            return found

        parsed = self._parsed(_keeping(kept), sorted({topic.split("[")[0] for topic in wanted}))
        for messages in parsed.kept:
            messages.take()
        samples = {topic: found.samples() for topic, found in columns.items()}
        return {topic: found for topic, found in samples.items() if len(found.times)}

    def _parsed(self, parser: type, names: list[str]) -> Any:
        from pyulog.exceptions import ULogException

        with Stream(self.path) as stream:
            try:
                # pyulog prints a line of a damaged file; the error below says it.
                with contextlib.redirect_stdout(io.StringIO()):
                    parsed = parser(stream, names)
            except (ULogException, struct.error, ValueError, KeyError, IndexError, TypeError, OSError) as error:
                raise self.damaged(error) from error
            is_cut = stream.is_cut
        notes = [f"{len(parsed.dropouts)} dropouts in the log, {sum(d.duration for d in parsed.dropouts)} ms"]
        notes = notes if parsed.dropouts else []
        if parsed.file_corruption:
            notes.append("parts of the file are damaged and were left out")
        elif is_cut:
            until = parsed.last_timestamp * MICRO
            notes.append(
                f"the file is cut off after {self.path.stat().st_size} bytes, within a message: it was read up to "
                f"{until:.3f} s"
            )
        self.faults += [note for note in notes if note not in self.faults]
        return parsed


def _name(name: str, instance: int) -> str:
    return f"{name}[{instance}]" if instance else name


class _Messages:
    """Stands where pyulog gathers the messages of a topic: keeps the fields that are wanted, a piece at a time."""

    def __init__(self, layout: np.dtype, kept: list[tuple[Columns, list[str]]]):
        self._layout, self._kept = layout, kept
        self._piece = bytearray()

    def __iadd__(self, content: bytes) -> "_Messages":
        if self._kept:
            self._piece += content
            if len(self._piece) >= PIECE:
                self.take()
        return self

    def __len__(self) -> int:
        return 0  # pyulog has nothing to unpack.

    def take(self) -> None:
        """Take the wanted fields from what was gathered."""
        found = np.frombuffer(bytes(self._piece), self._layout)
        for columns, paths in self._kept:
            columns.extend(found["timestamp"] * MICRO, np.column_stack([found[path] for path in paths]))
        self._piece.clear()


def _keeping(kept: Callable[[str, int, np.dtype], list[tuple[Columns, list[str]]]]) -> type:
    """A parser that keeps what `kept` says of a topic: name, instance, layout -> columns, and their fields."""
    from pyulog import ULog

    class Keeping(ULog):  # type: ignore[misc]
        def __init__(self, file: Any, names: list[str]):
            self.kept: list[_Messages] = []
            self._names = set(names)
            super().__init__(file, names)

        def _MessageAddLogged(self, data: bytes, header: Any, formats: Any) -> Any:  # noqa: N802
            message = ULog._MessageAddLogged(data, header, formats)
            if message.message_name in self._names:
                message.buffer = _Messages(message.dtype, kept(message.message_name, message.multi_id, message.dtype))
                self.kept.append(message.buffer)
            return message

    return Keeping


def _counting() -> type:
    """A parser that keeps no data: counts and times of messages."""
    from pyulog import ULog

    class Counting(ULog):  # type: ignore[misc]
        def __init__(self, *arguments: Any):
            self.listed: dict[int, Any] = {}
            self.counts: dict[int, int] = {}
            self.spans: dict[int, tuple[int, int]] = {}
            super().__init__(*arguments)

        def _MessageAddLogged(self, data: bytes, header: Any, formats: Any) -> Any:  # noqa: N802
            message = ULog._MessageAddLogged(data, header, formats)
            self.listed[message.msg_id] = message
            return message

        class _MessageData(ULog._MessageData):  # type: ignore[misc]
            def initialize(self, data: bytes, header: Any, subscriptions: Any, parser: "Counting") -> bool:
                (number,) = struct.unpack_from("<H", data)
                self.timestamp = parser._last_timestamp
                if (message := parser.listed.get(number)) is None:
                    return False
                parser.counts[number] = parser.counts.get(number, 0) + 1
                if len(data) >= 2 + message.timestamp_offset + 8:
                    (self.timestamp,) = struct.unpack_from("<Q", data, 2 + message.timestamp_offset)
                    first, last = parser.spans.get(number, (self.timestamp, self.timestamp))
                    parser.spans[number] = min(first, self.timestamp), max(last, self.timestamp)
                return False

    return Counting
