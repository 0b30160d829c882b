"""ArduPilot logs: DataFlash (.bin) and telemetry (.tlog)."""

import collections
import contextlib
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from .base import NUMBER, TEXT, Log, Samples, Topic
from .extract import Extractor, Lister
from .extras import extra
from .progress import bar
from .stream import refuse_empty

#: Time fields of a message: name -> nanoseconds.
TIMES = {"TimeUS": 1000, "TimeMS": 1_000_000}
#: The first bytes of a DataFlash message.
HEAD = b"\xa3\x95"
#: Types without measurements.
DEFINITIONS = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "FILE"}


class DataFlashLog(Log):
    """A DataFlash log, mapped into memory and read a message at a time.

    A type with instances is a topic each, `BARO[0]`; the log time is the field TimeUS, since boot.
    """

    kind = "DataFlash log"

    def __init__(self, path: Path):
        refuse_empty(path)
        super().__init__(path)
        extra("pymavlink.DFReader", "ardupilot", self.kind)
        self.start = 0

    def topics(self) -> dict[str, Topic]:
        found = {}
        with self._open() as reader:
            for name, number in reader.name_to_id.items():
                format = reader.formats[number]
                times = [field for field in TIMES if field in format.columns]
                if name in DEFINITIONS or not times or not reader.counts[number]:
                    continue
                kinds = {
                    field: TEXT if kind is str else NUMBER for field, kind in zip(format.columns, format.msg_types)
                }
                for topic, count in _instances(reader, format, number).items():
                    found[topic] = Topic(topic, name, count, kinds, _span(reader, format, number, times[0]))
        return dict(sorted(found.items()))

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        extractor = Extractor(self, wanted)
        types = {topic.split("[")[0] for topic in wanted}
        with self._open() as reader:
            types &= set(reader.name_to_id)
            total = sum(reader.counts[reader.name_to_id[name]] for name in types)
            with bar(total, " messages", self.path.name) as progress:
                while types and (message := reader.recv_match(type=types, strict=True)) is not None:
                    progress.update()
                    stamp = next((getattr(message, field) * unit for field, unit in _times(message)), None)
                    for topic in _topics(message):
                        if topic in wanted and stamp is not None:
                            extractor.add(topic, int(stamp), lambda message=message: message)
        return extractor.samples()

    @contextlib.contextmanager
    def _open(self) -> Iterator[Any]:
        from pymavlink.DFReader import DFReader_binary

        with open(self.path, "rb") as file:
            if file.read(2) != HEAD:
                raise self.damaged(ValueError("its first bytes are not a3 95"))
        said = io.StringIO()
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                reader = DFReader_binary(str(self.path))
        except (ValueError, IndexError, KeyError, TypeError, AttributeError, OSError, ArithmeticError) as error:
            raise self.damaged(error) from error
        with contextlib.redirect_stdout(said):
            yield reader
        reader.close()
        self._say_damage(reader)

    def _say_damage(self, reader: Any) -> None:
        """Notes bytes at the end that are no whole message."""
        ends = [
            offsets[-1] + reader.formats[number].len
            for number, offsets in enumerate(reader.offsets)
            if len(offsets) and number in reader.formats
        ]
        end, size = max(ends, default=0), self.path.stat().st_size
        if end != size:
            what = "within a message" if end > size else f"with {size - end} bytes that are no message"
            note = f"the file ends {what}: it was read up to byte {min(end, size)} of {size}"
            if note not in self.faults:
                self.faults.append(note)


class TlogLog(Log):
    """A telemetry log of MAVLink messages, read one at a time. A topic is a type of message, `ATTITUDE`.

    Messages of further senders have theirs behind it: `ATTITUDE@255:190`.
    """

    kind = "telemetry log"

    def __init__(self, path: Path):
        refuse_empty(path)
        super().__init__(path)
        extra("pymavlink.mavutil", "ardupilot", self.kind)

    def topics(self) -> dict[str, Topic]:
        lister = Lister()
        for topic, stamp, message in self._messages():
            lister.add(topic, message.get_type(), stamp, lambda message=message: message.to_dict())
        return lister.topics()

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        extractor = Extractor(self, wanted)
        for topic, stamp, message in self._messages():
            if topic in wanted:
                extractor.add(topic, stamp, lambda message=message: message.to_dict())
        return extractor.samples()

    def _messages(self) -> Iterator[tuple[str, int, Any]]:
        from pymavlink import mavutil

        senders: dict[str, tuple[int, int]] = {}
        file = mavutil.mavlogfile(str(self.path))
        with contextlib.closing(file), bar(self.path.stat().st_size, "B", self.path.name) as progress:
            while (message := file.recv_msg()) is not None:
                progress.n = file.f.tell()
                progress.update(0)
                kind, sender = message.get_type(), (message.get_srcSystem(), message.get_srcComponent())
                if kind == "BAD_DATA" or kind.startswith("UNKNOWN_"):
                    continue
                first = senders.setdefault(kind, sender)
                topic = kind if sender == first else f"{kind}@{sender[0]}:{sender[1]}"
                yield topic, round(message._timestamp * 1e9), message
        if not senders:
            raise self.damaged(ValueError("no MAVLink message in it"))


def _times(message: Any) -> list[tuple[str, int]]:
    return [(field, unit) for field, unit in TIMES.items() if field in message.get_fieldnames()]


def _topics(message: Any) -> list[str]:
    """Names of a message's topic: its type, with the instance where it has one; the first is the type's too."""
    if (field := message.fmt.instance_field) is None:
        return [message.get_type()]
    instance = getattr(message, field)
    return [f"{message.get_type()}[{instance}]", *([message.get_type()] if instance == 0 else [])]


def _instances(reader: Any, format: Any, number: int) -> dict[str, int]:
    """Messages of a type by topic, counted without decoding them."""
    if format.instance_field is None:
        return {format.name: reader.counts[number]}
    start, size = 3 + format.instance_ofs, format.instance_len
    counts = collections.Counter(
        bytes(reader.data_map[place + start : place + start + size]) for place in reader.offsets[number]
    )
    if size > 1:
        return {f"{format.name}[{name.rstrip(bytes(1)).decode()}]": count for name, count in counts.items()}
    return {f"{format.name}[{index[0]}]": count for index, count in counts.items()}


def _span(reader: Any, format: Any, number: int, field: str) -> float | None:
    """Seconds from the first message of a type to the last."""
    stamps = []
    for place in (reader.offsets[number][0], reader.offsets[number][-1]):
        reader.offset = place
        message = reader._parse_next()
        if message is None:
            return None
        stamps.append(getattr(message, field) * TIMES[field] * 1e-9)
    return stamps[1] - stamps[0]
