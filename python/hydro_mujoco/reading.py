"""Files that a user names: a file's kind and size come before its content, as in crates/files/src/reading.rs."""

import errno
import json
import os
import stat
from typing import IO, Any

from .errors import DataError

#: Largest text file [byte]: a card, a manifest, a model, a mapping.
TEXT = 1 << 26


def opened(path: str | os.PathLike[str], name: str = "", most: int | None = TEXT) -> IO[bytes]:
    """A file of at most `most` bytes, open for reading.

    Args:
        name: what a message calls it; its path by default.
        most: None for any size.

    Raises:
        DataError: there is none; it is a pipe, a device, a socket, a folder, or larger; what the system says.

    >>> opened("/dev/zero", "mapping /dev/zero")
    Traceback (most recent call last):
    hydro_mujoco.errors.DataError: mapping /dev/zero: is a device; expected a file
    """
    name = name or os.fspath(path)
    try:
        # Without the flag the opening of a pipe waits for somebody to write.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except (OSError, ValueError) as error:
        raise DataError(f"{name}: {_words(error)}") from error
    about = os.fstat(handle)
    fault = ""
    if not stat.S_ISREG(about.st_mode):
        fault = f"is {_kind(about.st_mode)}; expected a file"
    elif most is not None and about.st_size > most:
        fault = f"is {about.st_size} bytes; expected {most} at most"
    if fault:
        os.close(handle)
        raise DataError(f"{name}: {fault}")
    return os.fdopen(handle, "rb")


def check(path: str | os.PathLike[str], name: str = "", most: int | None = TEXT) -> None:
    """Refuse what `opened` refuses, before a library opens the file itself."""
    opened(path, name, most).close()


def read(path: str | os.PathLike[str], name: str = "", most: int = TEXT) -> bytes:
    """Content of a file, by `opened`."""
    with opened(path, name, most) as file:
        try:
            # It may grow while it is read.
            return file.read(most)
        except OSError as error:
            raise DataError(f"{name or os.fspath(path)}: {_words(error)}") from error


def read_text(path: str | os.PathLike[str], name: str = "", most: int = TEXT) -> str:
    """Text of a file, by `read`.

    Raises:
        DataError: as `opened`; bytes that are not UTF-8.
    """
    try:
        return read(path, name, most).decode()
    except UnicodeDecodeError as error:
        raise DataError(f"{name or os.fspath(path)}: is not UTF-8 text (byte {error.start})") from error


def read_json(path: str | os.PathLike[str], name: str = "", most: int = TEXT) -> Any:
    """Value of a JSON file, by `read_text`.

    Raises:
        DataError: as `read_text`; text that is no JSON.
    """
    try:
        return json.loads(read_text(path, name, most))
    except (ValueError, RecursionError) as error:
        raise DataError(f"{name or os.fspath(path)}: is no JSON ({error})") from error


def _words(error: OSError | ValueError) -> str:
    """What the system says of a file that it does not open."""
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, OSError) and error.errno == errno.ENXIO:
        return "is a socket; expected a file"
    return getattr(error, "strerror", None) or str(error)


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a pipe" if stat.S_ISFIFO(mode) else "a device"
