"""A file that counts what is read of it."""

import io
from pathlib import Path

from ...errors import DataError
from ...reading import check
from .progress import bar


class Stream(io.BufferedIOBase):
    """A file for reading, with a progress bar. is_cut: it ended within what a read asked for.

    end: byte before which it is read; the whole file by default.
    """

    def __init__(self, path: Path, end: int | None = None):
        self._file = open(path, "rb")  # noqa: SIM115
        self.size = path.stat().st_size if end is None else end
        self.is_cut = False
        self._bar = bar(self.size, "B", path.name)

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def read(self, size: int | None = -1) -> bytes:
        left = max(self.size - self._file.tell(), 0)
        content = self._file.read(left if size is None or size < 0 else min(size, left))
        self.is_cut |= size is not None and 0 < len(content) < size
        self._bar.n = max(self._bar.n, self._file.tell())
        self._bar.update(0)
        return content

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def close(self) -> None:
        if not self.closed:
            self._bar.close()
            self._file.close()
        super().close()


def refuse_empty(path: Path) -> None:
    """Refuse what is no file, or an empty one."""
    if path.is_dir():
        raise DataError(f"log {path}: is a folder; expected a file (a ROS 2 bag's folder holds metadata.yaml)")
    check(path, f"log {path}", most=None)
    if path.stat().st_size == 0:
        raise DataError(f"log {path}: the file is empty")
