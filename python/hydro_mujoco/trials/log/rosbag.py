"""ROS 2 bags (sqlite3 or MCAP; a folder with metadata.yaml, or one of its files) and ROS 1 bags."""

import contextlib
import functools
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...errors import DataError
from ...extras import extra
from ...reading import check
from .base import Log, Samples, Topic
from .extract import Extractor, Lister
from .progress import bar
from .stream import refuse_empty

METADATA = "metadata.yaml"


class RosbagLog(Log):
    """A bag, read by the package rosbags, a message at a time."""

    kind = "ROS bag"

    def __init__(self, path: Path):
        if not path.is_dir():
            refuse_empty(path)
        elif not os.path.exists(path / METADATA):
            there = ", ".join(sorted(file.name for file in path.iterdir())[:8]) or "nothing"
            raise DataError(
                f"log {path}: no {METADATA} in the folder (there is {there}); `ros2 bag reindex` writes it, or "
                "name the .mcap or .db3 file itself"
            )
        else:
            check(path / METADATA, f"log {path / METADATA}")
            for file in (file for file in path.iterdir() if not file.is_dir()):
                check(file, f"log {file}", most=None)
        super().__init__(path)
        extra("rosbags.highlevel", "rosbags", self.kind)

    def topics(self) -> dict[str, Topic]:
        lister = Lister()
        with self._open() as reader:
            span = max(reader.end_time - reader.start_time, 0) * 1e-9
            counts: dict[str, int] = {}
            for connection in reader.connections:
                counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
                for _, stamp, content in reader.messages([connection]):
                    lister.add(
                        connection.topic,
                        connection.msgtype,
                        stamp,
                        functools.partial(reader.deserialize, content, connection.msgtype),
                    )
                    break
        found = lister.topics()
        return {name: Topic(name, topic.type, counts[name], topic.fields, span) for name, topic in found.items()}

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        extractor = Extractor(self, wanted)
        with self._open() as reader:
            chosen = [connection for connection in reader.connections if connection.topic in wanted]
            if not chosen:
                return {}
            with bar(sum(connection.msgcount for connection in chosen), " messages", self.path.name) as progress:
                for connection, stamp, content in reader.messages(chosen):
                    extractor.add(
                        connection.topic,
                        stamp,
                        functools.partial(reader.deserialize, content, connection.msgtype),
                    )
                    progress.update()
        return extractor.samples()

    @contextlib.contextmanager
    def _open(self) -> Iterator[Any]:
        import apsw
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.rosbag1 import ReaderError as Ros1Error
        from rosbags.rosbag2 import ReaderError as Ros2Error
        from rosbags.typesys import Stores, get_typestore

        faults: tuple[type[Exception], ...] = (AnyReaderError, Ros1Error, Ros2Error, apsw.Error, *_parsing())
        try:
            with AnyReader([self.path], default_typestore=get_typestore(Stores.LATEST)) as reader:
                yield reader
        except faults as error:
            files = sorted(self.path.glob("*.mcap")) if self.path.is_dir() else []
            hint = f"; of a file that is cut {files[0]} is read up to the cut" if files else ""
            raise DataError(f"{self.damaged(error)}{hint}") from error


def _parsing() -> tuple[type[Exception], ...]:
    """What a file that cannot be read, or is cut, raises in the readers of rosbags."""
    import struct

    named = (OSError, AssertionError, struct.error, UnicodeDecodeError, EOFError, KeyError, IndexError, ValueError)
    # Raised where the cells of a database are of other types than they should be.
    return (*named, TypeError, AttributeError)
