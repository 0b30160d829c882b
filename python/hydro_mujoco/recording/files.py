"""Files that are whole or absent, and their fingerprints."""

import hashlib
import io
import json
import os
import secrets
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np

#: Bytes of an array from which on an entry of an archive has sizes of 64 bits.
ZIP64 = 1 << 30


@contextmanager
def written_beside(path: Path) -> Iterator[IO[bytes]]:
    """A new file of a random name, which is renamed at the end: never half a file, never through a link."""
    beside = path.with_name(f"{path.name}.{secrets.token_hex(6)}.tmp")
    try:
        with open(beside, "xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except BaseException:  # Ctrl-C too
        beside.unlink(missing_ok=True)
        raise


def write_beside(path: Path, content: bytes) -> None:
    """Write `content` by way of `written_beside`."""
    with written_beside(path) as file:
        file.write(content)


def write_npz(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """A file of what `npz_bytes` gives, with a part of an array in memory at a time."""
    with written_beside(path) as file:
        _archive(file, arrays)


def write_json(path: Path, value: object) -> None:
    """JSON with a stable layout, written by `write_beside`."""
    write_beside(path, (json.dumps(value, indent=1) + "\n").encode())


def sha256(path: Path) -> str:
    """Fingerprint of a file, read a piece at a time."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def npz_bytes(arrays: dict[str, np.ndarray]) -> bytes:
    """As `numpy.savez_compressed`, without the time of day: the same arrays give the same bytes."""
    file = io.BytesIO()
    _archive(file, arrays)
    return file.getvalue()


def _archive(file: IO[bytes], arrays: dict[str, np.ndarray]) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in arrays.items():
            array = np.asarray(array)
            # Entries that are opened by name are of 1980.
            with archive.open(f"{name}.npy", "w", force_zip64=array.nbytes > ZIP64) as entry:
                np.lib.format.write_array(entry, array, allow_pickle=False)
