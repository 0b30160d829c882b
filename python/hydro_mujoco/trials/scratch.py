"""Long tables of numbers on disk: a conversion holds a block of their rows in memory, however long the log.

The files have no name and vanish with the last array of them, or with the process. They are in TMPDIR, by default
/var/tmp, for /tmp may be in memory.
"""

import os
import tempfile
import weakref
from collections.abc import Iterator

import numpy as np

from ..errors import DataError

#: Numbers that are worked on at a time.
NUMBERS = 1 << 18
#: Values of a long series of which a median or a mean is taken.
ENOUGH = 1 << 16


class Table:
    """Rows of `columns` numbers: appended, then read as an array."""

    def __init__(self, columns: int):
        self.columns = columns
        self._count = 0
        self._folder = _folder()
        try:
            self._file = tempfile.TemporaryFile(dir=self._folder)  # noqa: SIM115
        except OSError as error:
            raise self._full(error) from error
        # Of a conversion that fails too.
        weakref.finalize(self, self._file.close)

    def __len__(self) -> int:
        return self._count

    def append(self, rows: np.ndarray) -> None:
        """Rows (n, columns).

        Raises:
            DataError: the disk is full.
        """
        try:
            self._file.write(np.ascontiguousarray(rows, float).tobytes())
        except OSError as error:
            raise self._full(error) from error
        self._count += len(rows)

    def array(self) -> np.ndarray:
        """All rows (n, columns), mapped from the file; nothing can be appended any longer."""
        shape = self._count, self.columns
        try:
            with self._file as file:
                file.flush()
                return np.asarray(np.memmap(file, float, "r+", shape=shape)) if all(shape) else np.empty(shape)
        except OSError as error:
            raise self._full(error) from error

    def _full(self, error: OSError) -> DataError:
        return DataError(
            f"folder {self._folder}, where the numbers of a log are kept while it is converted: "
            f"{error.strerror or error}; TMPDIR names another"
        )


def blocks(count: int, columns: int = 8) -> Iterator[slice]:
    """Slices that cut `count` rows of so many columns into blocks."""
    step = max(NUMBERS // columns, 1)
    for start in range(0, count, step):
        yield slice(start, min(start + step, count))


def some(count: int) -> np.ndarray:
    """Places in a series: all of them, or of a long one ENOUGH, drawn at random, the same every time."""
    if count <= ENOUGH:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).integers(count, size=ENOUGH))


def steps(times: np.ndarray) -> np.ndarray:
    """Steps between neighbours; of a long series some of them."""
    at = some(len(times) - 1) if len(times) else np.arange(0)
    return times[at + 1] - times[at]


def _folder() -> str:
    return os.environ.get("TMPDIR") or ("/var/tmp" if os.access("/var/tmp", os.W_OK) else tempfile.gettempdir())
