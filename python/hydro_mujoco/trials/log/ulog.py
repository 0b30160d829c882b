"""PX4 ULog files."""

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .base import NUMBER, Log, Samples, Topic
from .extras import extra
from .stream import Stream, refuse_empty

#: Seconds of a microsecond.
MICRO = 1e-6


class UlogLog(Log):
    """A ULog file, read by pyulog; of a topic that is asked for all fields are in memory while it is read.

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
        from pyulog import ULog

        names = sorted({topic.split("[")[0] for topic in wanted})
        parsed = self._parsed(ULog, names)
        found = {}
        for data in parsed.data_list:
            for topic in {_name(data.name, data.multi_id), f"{data.name}[{data.multi_id}]"} & set(wanted):
                for path in wanted[topic]:
                    if path not in data.data:
                        raise self.no_field(topic, path, data.data)
                values = np.column_stack([np.asarray(data.data[path], float) for path in wanted[topic]])
                found[topic] = Samples(tuple(wanted[topic]), data.data["timestamp"] * MICRO, values)
        return found

    def _parsed(self, parser: type, names: list[str]) -> Any:
        from pyulog.exceptions import ULogException

        with Stream(self.path) as stream:
            try:
                parsed = parser(stream, names)
            except (ULogException, struct.error, ValueError, KeyError, IndexError, TypeError) as error:
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
