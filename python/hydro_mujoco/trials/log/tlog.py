"""ArduPilot's telemetry logs (.tlog)."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...extras import extra
from .base import Log, Samples, Topic
from .extract import Extractor, Lister
from .progress import bar
from .stream import refuse_empty


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
            lister.add(topic, message.get_type(), stamp, message.to_dict)
        return lister.topics()

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        extractor = Extractor(self, wanted)
        for topic, stamp, message in self._messages():
            if topic in wanted:
                extractor.add(topic, stamp, message.to_dict)
        return extractor.samples()

    def _messages(self) -> Iterator[tuple[str, int, Any]]:
        from pymavlink import mavutil

        senders: dict[str, tuple[int, int]] = {}
        file, size = mavutil.mavlogfile(str(self.path)), self.path.stat().st_size
        read = lost = 0
        with contextlib.closing(file), bar(size, "B", self.path.name) as progress:
            while (message := file.recv_msg()) is not None:
                progress.n = read = file.f.tell()
                progress.update(0)
                kind, sender = message.get_type(), (message.get_srcSystem(), message.get_srcComponent())
                lost += len(message.get_msgbuf()) if kind == "BAD_DATA" else 0
                if kind == "BAD_DATA" or kind.startswith("UNKNOWN_"):
                    continue
                first = senders.setdefault(kind, sender)
                topic = kind if sender == first else f"{kind}@{sender[0]}:{sender[1]}"
                yield topic, round(message._timestamp * 1e9), message
        if not senders:
            raise self.damaged(ValueError("no MAVLink message in it"))
        faults = [f"{lost} bytes are no message and were left out"] if lost else []
        faults += [f"the file ends within a message: it was read up to byte {read} of {size}"] if read < size else []
        self.faults += [fault for fault in faults if fault not in self.faults]
