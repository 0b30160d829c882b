"""Files that are whole or absent, and their fingerprints."""

import hashlib
import io
import json
import os
import secrets
import zipfile
from pathlib import Path

import numpy as np


def write_beside(path: Path, content: bytes) -> None:
    """Write `content` to a new file of a random name and rename it: never half a file, never through a link."""
    beside = path.with_name(f"{path.name}.{secrets.token_hex(6)}.tmp")
    try:
        with open(beside, "xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except BaseException:  # Ctrl-C too
        beside.unlink(missing_ok=True)
        raise


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
    with zipfile.ZipFile(file, "w") as archive:
        for name, array in arrays.items():
            content = io.BytesIO()
            np.lib.format.write_array(content, np.asarray(array), allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content.getvalue(), compresslevel=9)
    return file.getvalue()
