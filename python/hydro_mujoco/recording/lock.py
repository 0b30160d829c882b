"""A folder that one process works in; `hydro` takes the same kind of lock."""

import errno
import fcntl
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import DataError

#: Times that a lock is tried whose file goes away each time.
ATTEMPTS = 100


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock whose file is `path`. The system lets go of that of a process that died.

    Raises:
        DataError: another process holds it, and which one.
    """
    file = _take(path)
    try:
        yield
    finally:
        if file is not None:
            path.unlink(missing_ok=True)
            os.close(file)


def _take(path: Path) -> int | None:
    """The locked file; `None` where the file system knows no locks."""
    for _ in range(ATTEMPTS):
        try:
            # A link that stands there is not followed, nor is a pipe waited for.
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
        except OSError as error:
            raise DataError(f"lock {path}: {error.strerror}") from error
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.read(file, 300).decode("utf-8", "replace") or "another"
            os.close(file)
            if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                path.unlink(missing_ok=True)
                return None
            raise DataError(
                f"{path.parent}: process {holder} is at work there; wait, or choose another folder"
            ) from error
        # The holder before may have removed the file between the opening and the locking.
        if path.exists() and path.stat().st_ino == os.fstat(file).st_ino:
            os.ftruncate(file, 0)
            os.write(file, f"{os.getpid()} ({Path(sys.argv[0]).name})".encode())
            return file
        os.close(file)
    raise DataError(f"{path.parent}: other processes are at work there; wait, or choose another folder")
