"""A log as every reader gives it: topics of messages with fields, read as numbers against time."""

from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DataError
from ..scratch import Table
from ..words import listed

#: Kinds of a field.
NUMBER, TEXT, TIME = "number", "text", "time"
#: Numbers of single rows that are gathered before they are put away.
PIECE = 1 << 16


@dataclass(frozen=True)
class Topic:
    """What a log holds of a topic. fields: path -> NUMBER, TEXT or TIME; seconds: from first to last message."""

    name: str
    type: str
    count: int
    fields: Mapping[str, str]
    seconds: float | None = None

    @property
    def rate(self) -> float | None:
        """Messages a second."""
        return (self.count - 1) / self.seconds if self.seconds and self.count > 1 else None


@dataclass(frozen=True)
class Samples:
    """Fields of a topic, in the file's order. times: log time [s] since its start, (n,); values: (n, fields)."""

    fields: tuple[str, ...]
    times: np.ndarray
    values: np.ndarray


@dataclass
class Log(ABC):
    """A log file. Readers stream: the numbers of the fields asked for are put away on disk, 8 bytes each.

    start: log time zero [ns], known after the first message; faults: what is wrong with the file;
    words: number that stands for each text of a field.
    """

    path: Path
    start: int | None = None
    faults: list[str] = field(default_factory=list)
    words: dict[str, float] = field(default_factory=dict)

    #: What it is, in a message.
    kind = "log"
    #: True where a row's time is a column of the file, which the mapping names.
    is_table = False

    @abstractmethod
    def topics(self) -> dict[str, Topic]:
        """All topics by name."""

    @abstractmethod
    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        """The fields `wanted` of topics, {topic: paths}; a topic without a message is left out.

        Raises:
            DataError: a message has no such field, or it is no number.
        """

    def number(self, value: Any, path: str, topic: str) -> float:
        """A field's value as a number: a time [s] since the log's start, a text by its number in `words`."""
        if isinstance(value, str):
            return self.words.setdefault(value, float(len(self.words)))
        if (stamp := nanoseconds(value)) is not None:
            return (stamp - (self.start or 0)) * 1e-9
        try:
            return float(value)
        except (TypeError, ValueError):
            raise DataError(
                f"{self.path}, topic `{topic}`: field `{path}` is no number but {type(value).__name__}; name one "
                "of its parts"
            ) from None

    def since_start(self, stamp: int) -> float:
        """Log time [s] since the start, which the first message sets. stamp: [ns]."""
        if self.start is None:
            self.start = stamp
        return (stamp - self.start) * 1e-9

    def damaged(self, error: Exception) -> DataError:
        """The error of a file that its reader cannot make sense of."""
        said = " ".join(str(error).split())[:200]
        return DataError(f"{self.path}: no {self.kind} that can be read ({said or type(error).__name__})")

    def no_field(self, topic: str, path: str, there: Iterable[str]) -> DataError:
        """The error of a field that the messages of a topic lack."""
        return DataError(f"{self.path}, topic `{topic}`: no field `{path}`; its fields are {listed(there)}")


class Columns:
    """Numbers that arrive row by row, or some rows at a time, and are put away on disk."""

    def __init__(self, fields: Sequence[str]):
        self.fields = tuple(fields)
        self._table = Table(1 + len(self.fields))
        self._rows = array("d")

    def add(self, time: float, values: Iterable[float]) -> None:
        """A row."""
        self._rows.append(time)
        self._rows.extend(values)
        if len(self._rows) >= PIECE:
            self._put_away()

    def extend(self, times: np.ndarray, values: np.ndarray) -> None:
        """Rows (n, fields)."""
        self._put_away()
        self._table.append(np.column_stack([times, values]))

    def samples(self) -> Samples:
        """All rows; none can come any longer."""
        self._put_away()
        rows = self._table.array()
        return Samples(self.fields, rows[:, 0], rows[:, 1:])

    def _put_away(self) -> None:
        if self._rows:
            self._table.append(np.array(self._rows).reshape(-1, 1 + len(self.fields)))
            self._rows = array("d")


def nanoseconds(value: object) -> int | None:
    """A ROS or protobuf time [ns]; None for anything else."""
    for seconds, rest in (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"), ("seconds", "nanos")):
        if isinstance(value, dict):
            if seconds in value and rest in value:
                return int(value[seconds]) * 10**9 + int(value[rest])
        elif hasattr(value, seconds) and hasattr(value, rest):
            return int(getattr(value, seconds)) * 10**9 + int(getattr(value, rest))
    return None
