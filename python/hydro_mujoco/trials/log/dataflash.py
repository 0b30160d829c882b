"""ArduPilot's DataFlash logs (.bin)."""

import functools
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...extras import extra
from .base import NUMBER, TEXT, Log, Samples, Topic
from .extract import Extractor
from .stream import Stream, refuse_empty

#: Time fields of a message: name -> nanoseconds.
TIMES = {"TimeUS": 1000, "TimeMS": 1_000_000}
#: The first bytes of a message, before its type's number.
HEAD = b"\xa3\x95"
#: Types that say what others hold; the first is of this number and length and has these fields.
DEFINITIONS = ("FMT", "FMTU", "UNIT", "MULT")
FMT = (0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
#: Bytes read at a time.
PIECE = 1 << 22


class DataFlashLog(Log):
    """A DataFlash log, read a message at a time; formats and units are pymavlink's.

    A type with instances is a topic each, `BARO[0]`, and `BARO` is its first; the log time is TimeUS, since boot.
    """

    kind = "DataFlash log"

    def __init__(self, path: Path):
        refuse_empty(path)
        super().__init__(path)
        extra("pymavlink.DFReader", "ardupilot", self.kind)
        self.start = 0

    def topics(self) -> dict[str, Topic]:
        formats: dict[str, _Format] = {}
        counts: dict[str, int] = {}
        spans: dict[str, tuple[int, int]] = {}
        for format, body in self._messages():
            topic, stamp = format.topic(body), format.stamp(body)
            formats[topic] = format
            counts[topic] = counts.get(topic, 0) + 1
            first, last = spans.get(topic, (stamp, stamp))
            spans[topic] = min(first, stamp), max(last, stamp)
        return {
            name: Topic(name, formats[name].name, counts[name], formats[name].kinds, (last - first) * 1e-9)
            for name, (first, last) in sorted(spans.items())
        }

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        extractor = Extractor(self, wanted)
        types = {topic.split("[")[0] for topic in wanted}
        for format, body in self._messages():
            if format.name not in types:
                continue
            topic, stamp = format.topic(body), format.stamp(body)
            for name in {topic, format.name if topic.endswith("[0]") else topic}:
                if name in wanted:
                    extractor.add(name, stamp, functools.partial(format.message, body))
        return extractor.samples()

    def _messages(self) -> Iterator[tuple["_Format", bytes]]:
        """Format and body of every message that has a time."""
        formats = {FMT[0]: _Format(*FMT)}
        buffer, at, lost = b"", 0, 0
        with Stream(self.path) as stream:
            if stream.read(len(HEAD)) != HEAD:
                raise self.damaged(ValueError("its first bytes are not a3 95"))
            stream.seek(0)
            while piece := stream.read(PIECE):
                buffer, at = buffer[at:] + piece, 0
                while len(buffer) - at >= 3:
                    format = formats.get(buffer[at + 2]) if buffer.startswith(HEAD, at) else None
                    if format is None:
                        found = buffer.find(HEAD, at + 1)
                        found = found if found >= 0 else len(buffer) - 1
                        lost, at = lost + found - at, found
                        continue
                    if at + format.length > len(buffer):
                        break
                    body, at = buffer[at + 3 : at + format.length], at + format.length
                    if format.is_definition:
                        self._define(formats, format, body)
                    elif format.has_time:
                        yield format, body
        if lost:
            self._say(f"{lost} bytes are no message and were left out")
        if rest := len(buffer) - at:
            size = self.path.stat().st_size
            self._say(f"the file ends within a message: it was read up to byte {size - rest} of {size}")

    def _define(self, formats: dict[int, "_Format"], format: "_Format", body: bytes) -> None:
        """A type, or which of its fields is the instance."""
        values = format.message(body)
        try:
            if format.name == "FMT":
                new = _Format(*values.values())
                formats.setdefault(new.number, new)
            elif format.name == "FMTU" and (other := formats.get(values["FmtType"])) and "#" in values["UnitIds"]:
                other.set_instance(values["UnitIds"].index("#"))
        except (KeyError, IndexError, ValueError) as error:
            self._say(f"a definition in it cannot be read ({error})")

    def _say(self, fault: str) -> None:
        if fault not in self.faults:
            self.faults.append(fault)


class _Format:
    """A type of message. length: of a message with its head [byte]; kinds: of its fields."""

    def __init__(self, number: int, length: int, name: str, format: str, columns: str):
        from pymavlink.DFReader import FORMAT_TO_STRUCT

        self.number, self.length, self.name = number, length, name
        self.is_definition = name in DEFINITIONS
        self._columns = columns.split(",")
        # Of each field: code of struct, factor or None, Python's type.
        fields = [FORMAT_TO_STRUCT[code] for code in format]
        self._codes = [code for code, _, _ in fields]
        self._layout = struct.Struct("<" + "".join(self._codes))
        if len(fields) != len(self._columns) or self._layout.size != length - len(HEAD) - 1:
            raise ValueError(
                f"{name}: {len(fields)} fields of {self._layout.size} bytes, {columns}, {length} bytes in all"
            )
        self._decoders = [_decoder(*field) for field in fields]
        self.kinds = {column: TEXT if kind is str else NUMBER for column, (_, _, kind) in zip(self._columns, fields)}
        times = [
            (*self._place(self._columns.index(field)), unit) for field, unit in TIMES.items() if field in self.kinds
        ]
        self._stamp = times[0] if times else None
        self._instance: tuple[struct.Struct, int] | None = None

    @property
    def has_time(self) -> bool:
        """True where a message says when it was logged."""
        return self._stamp is not None

    def message(self, body: bytes) -> dict[str, Any]:
        """Values by field."""
        values = self._layout.unpack(body)
        return {name: decode(value) for name, decode, value in zip(self._columns, self._decoders, values)}

    def stamp(self, body: bytes) -> int:
        """Its time [ns], where `has_time`."""
        assert self._stamp is not None
        layout, place, unit = self._stamp
        return int(layout.unpack_from(body, place)[0]) * unit

    def topic(self, body: bytes) -> str:
        """Name of its topic."""
        if self._instance is None:
            return self.name
        layout, place = self._instance
        (value,) = layout.unpack_from(body, place)
        return f"{self.name}[{_text(value) if isinstance(value, bytes) else value}]"

    def set_instance(self, column: int) -> None:
        """Take the number, or the name, of the instance from a column."""
        self._instance = self._place(column)

    def _place(self, column: int) -> tuple[struct.Struct, int]:
        """Layout of a column, and the bytes before it."""
        return struct.Struct("<" + self._codes[column]), struct.calcsize("<" + "".join(self._codes[:column]))


def _decoder(code: str, factor: float | None, kind: type) -> Callable[[Any], Any]:
    """From what struct gives to a field's value."""
    if kind is str:
        return _text
    # A hundredth is exact as a division.
    return (lambda value: value / round(1 / factor)) if factor else (lambda value: value)


def _text(value: bytes) -> str:
    return value.split(b"\0")[0].decode("latin-1")
